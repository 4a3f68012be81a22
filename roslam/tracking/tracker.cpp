// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tracker.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"

namespace roslam {

namespace {
// Standard deviation of the position along its least certain direction, metres.
double position_sigma(const Matrix6d& covariance) {
  const Eigen::Matrix3d position = covariance.topLeftCorner<3, 3>();
  return std::sqrt(std::max(0.0, position.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff()));
}

// The first camera defines the world frame, assumed level: x forward, y left, z up (REP 103).
SE3 first_T_camera_world() {
  Eigen::Matrix3d R;
  R << 0, -1, 0,  //
      0, 0, -1,   //
      1, 0, 0;
  return {R, Eigen::Vector3d::Zero()};
}
}  // namespace

std::string_view name_of(TrackingState state) {
  switch (state) {
    case TrackingState::kInitialising:
      return "initialising";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kPredicted:
      return "predicted";
    case TrackingState::kRecentlyLost:
      return "recently lost";
    case TrackingState::kLost:
      return "lost";
  }
  return "unknown";
}

void TrackerOptions::validate() const {
  if (min_initial_points < 10) throw OptionsError("tracker.min_initial_points must be at least 10");
  if (min_inliers < 6) throw OptionsError("tracker.min_inliers must be at least 6");
  if (min_frame_matches < 6) throw OptionsError("tracker.min_frame_matches must be at least 6");
  if (!(min_agreement >= 0.0 && min_agreement <= 1.0))
    throw OptionsError("tracker.min_agreement must be 0 to 1");
  if (trusted_inliers < 1) throw OptionsError("tracker.trusted_inliers must be at least 1");
  if (scarce_inliers < 0) throw OptionsError("tracker.scarce_inliers must not be negative");
  if (!(hidden_share >= 0.0 && hidden_share <= 1.0))
    throw OptionsError("tracker.hidden_share must be 0 to 1");
  if (!(max_predicted >= 0.0 && max_predicted <= 60.0))
    throw OptionsError("tracker.max_predicted must be 0 to 60 seconds");
  if (!(max_wait_to_start >= 0.0 && max_wait_to_start <= 60.0))
    throw OptionsError("tracker.max_wait_to_start must be 0 to 60 seconds");
  if (new_submap_after_lost < 0) throw OptionsError("tracker.new_submap_after_lost must not be negative");
  if (recently_lost_frames < 0) throw OptionsError("tracker.recently_lost_frames must not be negative");
}

Tracker::Tracker(const Camera& camera, Map& map, const Settings& settings)
    : camera_(camera),
      map_(map),
      settings_(settings),
      matcher_(settings.matcher),
      initial_pose_(camera, map, {settings.tracker, settings.matcher, settings.pose, settings.noise}),
      local_map_(settings.local_map),
      relocaliser_(settings.relocaliser,
                   GeometricVerifier(camera, {settings.geometric_verifier, settings.matcher, settings.pose,
                                              settings.noise})) {
  settings.tracker.validate();
  settings.plausible.validate();
  settings.matcher.validate();
  settings.pose.validate();
  settings.local_map.validate();
  settings.relocaliser.validate();
  settings.noise.validate();
}

TrackedFrame Tracker::track(std::shared_ptr<const ObservedFrame> view, double timestamp,
                            const FrameHint& hint) {
  times_ = {};
  TrackedFrame frame;
  frame.timestamp = timestamp;
  frame.landmarks.resize(view->size());
  frame.view = std::move(view);
  if (map_.keyframe_count() == 0) {
    return can_start(frame, hint) ? initialise(std::move(frame)) : frame;
  }

  const bool was_known = state_ == TrackingState::kTracking || state_ == TrackingState::kPredicted;
  const bool found = (was_known && follow(frame, hint)) || relocalise(frame, hint);
  if (found) {
    state_ = TrackingState::kTracking;
    frames_lost_ = frames_unrecognised_ = 0;
    waits_since_.reset();
    relocaliser_.restart();
    frame.quality = std::min(1.0, frame.inliers / static_cast<double>(settings_.tracker.trusted_inliers));
    count_found(frame);
    frame.covariance =
        covariance_.of_frame(map_, *frame.T_camera_world, frame.landmarks, frame.measurement_covariance);
    remember(frame);
  } else if (was_known && predict_hidden(frame, hint)) {
    state_ = TrackingState::kPredicted;
  } else if (const bool could_start = can_start(frame, hint);
             could_start && ++frames_unrecognised_ == settings_.tracker.new_submap_after_lost) {
    return initialise(std::move(frame));
  } else {
    ++frames_lost_;
    state_ = frames_lost_ <= settings_.tracker.recently_lost_frames ? TrackingState::kRecentlyLost
                                                                    : TrackingState::kLost;
    velocity_.reset();
    drop_pose(frame);
  }
  frame.state = state_;
  if (found) withhold_poor_fit(frame);
  return frame;
}

void Tracker::drop_pose(TrackedFrame& frame) {
  frame.T_camera_world.reset();
  frame.covariance.setZero();
  frame.inliers = frame.visible = 0;
  frame.quality = 0.0;
  frame.landmarks.assign(frame.view->size(), {});
}

// A pose of poor fit is good enough to find the next frame from it, not to be given out: it is off by
// centimetres. Where that lasts, it is the map that is poor.
void Tracker::withhold_poor_fit(TrackedFrame& frame) {
  constexpr double kLongest = 0.3;  // seconds
  const bool is_poor = frame.pixel_error_scale > settings_.plausible.max_pixel_error &&
                       frame.inliers < settings_.plausible.poor_found_share * frame.visible;
  if (!is_poor) {
    last_fit_ = frame.timestamp;
  } else if (last_fit_ && frame.timestamp - *last_fit_ <= kLongest) {
    ++doubts_[PoseDoubt::kPoorFit];
    frame.state = TrackingState::kRecentlyLost;
    drop_pose(frame);
  }
}

bool Tracker::can_start(const TrackedFrame& frame, const FrameHint& hint) {
  const ObservedFrame& view = *frame.view;
  int known = 0;
  for (std::size_t i = 0; i < view.size(); ++i) known += view.depths[i] > 0.0F && !view.may_move(i) ? 1 : 0;
  if (known < settings_.tracker.min_initial_points) return false;
  if (hint.may_start) {
    waits_since_.reset();
    return true;
  }
  // The wait is bounded, as labels may be wrong, or what is movable may rest before the camera for good.
  if (!waits_since_) waits_since_ = frame.timestamp;
  return frame.timestamp - *waits_since_ >= settings_.tracker.max_wait_to_start;
}

// The first frame of a submap.
TrackedFrame Tracker::initialise(TrackedFrame frame) {
  frame.T_camera_world = first_T_camera_world();
  frame.landmarks.assign(frame.view->size(), {});
  frame.reference = {};
  frame.inliers = 0;
  frame.quality = 1.0;
  frame.state = state_ = TrackingState::kTracking;
  frames_lost_ = frames_unrecognised_ = 0;
  relocaliser_.restart();
  velocity_.reset();
  waits_since_.reset();
  last_ = frame;
  return frame;
}

std::optional<SE3> Tracker::predicted_pose(double timestamp) const {
  const bool is_known = state_ == TrackingState::kTracking || state_ == TrackingState::kPredicted;
  if (!is_known || map_.keyframe_count() == 0) return std::nullopt;
  return predict_pose(timestamp);
}

// The candidates by predictions are tried first. Where they are refused, or few inliers support the best, the
// reference keyframe, by descriptors, and the last frame, in a wide search, give others.
bool Tracker::follow(TrackedFrame& frame, const FrameHint& hint) {
  if (!last_.reference.is_valid()) return false;
  const Stopwatch watch;
  const SE3 T_world_last = last_pose()->inverse();
  const std::vector<SE3> predicted = predictions(frame.timestamp, hint.T_camera_world);
  std::vector<PoseCandidate> candidates;
  const auto add = [&](std::optional<PoseCandidate> candidate) {
    if (candidate) candidates.push_back(std::move(*candidate));
  };
  bool is_trusted = false;
  for (const SE3& pose : predicted) {
    add(initial_pose_.from_last_frame(*frame.view, last_, T_world_last, pose, 1.0F));
    is_trusted |= !candidates.empty() && candidates.back().inliers >= settings_.tracker.trusted_inliers;
  }
  times_.match_frame += watch.seconds();
  if (is_trusted && accept_best(frame, std::exchange(candidates, {}), hint)) return true;
  const Stopwatch second_watch;
  if (const Keyframe* reference = map_.find(last_.reference))
    add(initial_pose_.from_keyframe(*frame.view, *reference, T_world_last.inverse()));
  constexpr float kWider = 3.0F;
  add(initial_pose_.from_last_frame(*frame.view, last_, T_world_last,
                                    predicted.empty() ? T_world_last.inverse() : predicted.front(), kWider));
  times_.match_frame += second_watch.seconds();
  return accept_best(frame, std::move(candidates), hint);
}

// Refines the candidates with the local map, those with most inliers first, until one is accepted.
bool Tracker::accept_best(TrackedFrame& frame, std::vector<PoseCandidate> candidates, const FrameHint& hint) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.inliers > b.inliers; });
  const KeyframeId near = map_.T_camera_anchor(last_.reference).first;
  for (PoseCandidate& candidate : candidates) {
    refine_with_local_map(frame, std::move(candidate), near, hint.depth);
    if (is_accepted(frame, settings_.tracker.min_inliers)) return true;
  }
  return false;
}

PoseDoubt Tracker::doubt_of(const TrackedFrame& frame, int min_inliers) const {
  if (frame.inliers < min_inliers) return PoseDoubt::kFewInliers;
  if (frame.inliers < settings_.plausible.min_found_share * frame.visible) return PoseDoubt::kFewFound;
  const bool is_same_submap =
      last_.reference.is_valid() && map_.submap_of(last_.reference) == map_.submap_of(frame.reference);
  if (!is_same_submap) return PoseDoubt::kNone;
  MotionState last{last_.timestamp, last_pose()->inverse(), position_sigma(last_.measurement_covariance), {}};
  if (velocity_) last.velocity = -(last.T_world_camera.rotation() * velocity_->head<3>());
  return check_motion(last, frame.timestamp, frame.T_camera_world->inverse(),
                      position_sigma(frame.measurement_covariance), settings_.plausible);
}

bool Tracker::is_accepted(const TrackedFrame& frame, int min_inliers) {
  const PoseDoubt doubt = doubt_of(frame, min_inliers);
  if (doubt != PoseDoubt::kNone) ++doubts_[doubt];
  return doubt == PoseDoubt::kNone;
}

// By optical flow and by the motion model, unless they agree. Either may be wrong: flow on repeated
// structure, the motion model where the motion changes.
std::vector<SE3> Tracker::predictions(double timestamp, const std::optional<SE3>& by_flow) const {
  std::vector<SE3> result;
  if (by_flow) result.push_back(*by_flow);
  if (!velocity_) return result;
  const SE3 by_motion = predict_pose(timestamp);
  const bool agrees = by_flow && initial_pose_.disagreement(last_, last_pose()->inverse(), *by_flow,
                                                            by_motion) < settings_.matcher.frame_radius;
  if (!agrees) result.push_back(by_motion);
  return result;
}

std::optional<SE3> Tracker::last_pose() const {
  if (!last_.reference.is_valid()) return last_.T_camera_world;
  return T_last_reference_ * map_.T_camera_world(last_.reference);
}

SE3 Tracker::predict_pose(double timestamp) const {
  const SE3 last = *last_pose();
  if (!velocity_) return last;
  // Constant velocity at first, then it decays exponentially: over many frames the model does not hold.
  constexpr double kSteady = 0.1;  // seconds of constant velocity
  constexpr double kDecay = 0.4;   // seconds, time constant
  const double elapsed = timestamp - last_.timestamp;
  const double beyond = std::max(elapsed - kSteady, 0.0);
  const double duration = std::min(elapsed, kSteady) + kDecay * (1.0 - std::exp(-beyond / kDecay));
  return SE3::exp(*velocity_ * duration) * last;
}

// Whether a surface in the image is nearer than the landmark, so that it cannot be seen.
bool Tracker::is_occluded(const Prediction& predicted, const cv::Mat& depth) const {
  if (depth.empty()) return false;
  const Eigen::Vector2d pixel = camera_.distort(predicted.pixel.cast<double>());
  const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  if (!cv::Rect({0, 0}, depth.size()).contains(at)) return false;
  const double now = depth.at<float>(at);
  return now > 0.0 && now < (1.0 - settings_.matcher.depth_tolerance) * static_cast<double>(predicted.depth);
}

void Tracker::match_local_landmarks(TrackedFrame& frame, const cv::Mat& depth) {
  std::vector<bool> is_matched(map_.landmark_slots(), false);
  frame.visible = 0;
  for (const LandmarkId id : frame.landmarks) {
    if (!id.is_valid()) continue;
    is_matched[id.index()] = true;
    ++frame.visible;
  }
  // Cosine between viewing directions from which the search radius is smaller (as in ORB-SLAM).
  constexpr float kFrontal = 0.998F;
  for (const LandmarkId id : local_map_.landmarks()) {
    if (is_matched[id.index()]) continue;
    Landmark& landmark = *map_.find(id);
    const auto predicted = predict(landmark, map_, *frame.view, camera_, *frame.T_camera_world);
    if (!predicted) continue;
    ++landmark.times_visible;
    const float factor = predicted->view_cosine > kFrontal ? 2.5F : 4.0F;
    const float radius =
        factor * static_cast<float>(settings_.matcher.map_radius) * map_.scale(predicted->level);
    const int match = matcher_.find({predicted->pixel, radius, predicted->level - 1, predicted->level + 1,
                                     predicted->depth, settings_.matcher.max_distance, true},
                                    landmark.descriptor, *frame.view, frame.landmarks);
    if (match >= 0) frame.landmarks[static_cast<std::size_t>(match)] = id;
    frame.visible += match >= 0 || !is_occluded(*predicted, depth) ? 1 : 0;
  }
}

void Tracker::refine_with_local_map(TrackedFrame& frame, PoseCandidate candidate, KeyframeId near,
                                    const cv::Mat& depth) {
  Stopwatch watch;
  frame.T_camera_world = candidate.T_camera_world;
  frame.landmarks = std::move(candidate.landmarks);
  local_map_.update(map_, frame.landmarks, near);
  frame.reference = local_map_.reference();
  match_local_landmarks(frame, depth);
  times_.match_map += watch.seconds();
  watch = {};
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].is_valid()) continue;
    positions.push_back(map_.find(frame.landmarks[i])->position);
    points.push_back(i);
  }
  if (static_cast<int>(points.size()) < settings_.tracker.scarce_inliers) {
    for (const TemporaryPoint& temporary : candidate.temporary) {
      if (frame.landmarks[temporary.point].is_valid()) continue;
      positions.push_back(temporary.position);
      points.push_back(temporary.point);
    }
  }
  const OptimisedPose pose =
      optimise_frame(camera_, map_, *frame.view, points, positions, *frame.T_camera_world, settings_.noise,
                     settings_.pose, frame.landmarks);
  frame.T_camera_world = pose.T_camera_world;
  frame.measurement_covariance = pose.covariance;
  frame.pixel_error_scale = pose.pixel_error_scale;
  frame.inliers = pose.inliers;
  times_.optimise += watch.seconds();
}

// While dynamic objects hide the scene, the pose is extrapolated with the motion model for a limited time.
bool Tracker::predict_hidden(TrackedFrame& frame, const FrameHint& hint) {
  const bool is_hidden = hint.hidden_share >= settings_.tracker.hidden_share;
  if (!is_hidden || frame.timestamp - last_.timestamp > settings_.tracker.max_predicted) return false;
  frame.T_camera_world = predict_pose(frame.timestamp);
  frame.covariance = PoseCovariance::of_prediction(
      last_.covariance, *frame.T_camera_world * last_pose()->inverse(), frame.timestamp - last_.timestamp);
  frame.reference = last_.reference;
  frame.inliers = 0;
  frame.landmarks.assign(frame.view->size(), {});
  return true;
}

bool Tracker::relocalise(TrackedFrame& frame, const FrameHint& hint) {
  const Stopwatch watch;
  const auto similar = hint.similar_keyframes ? hint.similar_keyframes() : std::vector<KeyframeId>{};
  // No prior on the pose: lost for long, or no frame tracked yet in a loaded map.
  const bool search_all = last_.view == nullptr || frames_lost_ >= settings_.tracker.recently_lost_frames;
  const auto found = relocaliser_.find(map_, *frame.view, similar, search_all);
  times_.relocalise += watch.seconds();
  if (!found) return false;
  PoseCandidate candidate{found->T_camera_world, found->landmarks, {}, 0};
  // A wrong relocalisation would corrupt the map: the local map must give twice the usual inliers.
  refine_with_local_map(frame, std::move(candidate), found->matched_keyframe, hint.depth);
  return is_accepted(frame, 2 * settings_.tracker.min_inliers);
}

void Tracker::count_found(const TrackedFrame& frame) {
  for (const LandmarkId id : frame.landmarks) {
    if (!id.is_valid()) continue;
    Landmark& landmark = *map_.find(id);
    ++landmark.times_found;
    landmark.times_visible = std::max(landmark.times_visible, landmark.times_found);
  }
}

void Tracker::remember(const TrackedFrame& frame) {
  const double elapsed = frame.timestamp - last_.timestamp;
  constexpr double kMaxGap = 0.5;  // seconds; after a longer gap the velocity is of no use
  const bool is_same_submap =
      last_.reference.is_valid() && map_.submap_of(last_.reference) == map_.submap_of(frame.reference);
  if (is_same_submap && elapsed > 0.0 && elapsed < kMaxGap) {
    velocity_ = (*frame.T_camera_world * last_pose()->inverse()).log() / elapsed;
  } else {
    velocity_.reset();
  }
  last_ = frame;
  T_last_reference_ = *frame.T_camera_world * map_.T_camera_world(frame.reference).inverse();
}

void Tracker::keyframe_created(KeyframeId id) {
  const Keyframe& keyframe = *map_.find(id);
  covariance_.add_keyframe(id, last_.covariance);
  last_.reference = id;
  last_.landmarks = keyframe.landmarks;
  T_last_reference_ = SE3();
}

void Tracker::restart_clock(double timestamp) {
  velocity_.reset();
  waits_since_.reset();
  last_fit_.reset();
  last_.timestamp = timestamp;
}

}  // namespace roslam
