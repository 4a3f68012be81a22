// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/tracking/resting_points.hpp"

namespace roslam {

Tracker::Tracker(const Camera& camera, Map& map, const Settings& settings)
    : camera_(camera),
      map_(map),
      settings_(settings),
      matcher_(settings.matcher),
      initial_pose_(camera, map, {settings.tracker, settings.matcher, settings.pose, settings.noise}),
      local_map_(settings.local_map),
      relocaliser_(settings.relocaliser,
                   GeometricVerifier(camera, {settings.geometric_verifier, settings.matcher, settings.pose,
                                              settings.noise})),
      motion_(camera, map, settings.plausible, settings.tracker.use_gyroscope) {
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
    return can_start(frame, hint) ? initialise(std::move(frame), hint.T_camera_start) : frame;
  }

  is_contradiction_ = false;
  rested_ = hint.rested;
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
    reconsider(frame);
    remember(frame);
  } else if (was_known && predict_hidden(frame, hint)) {
    state_ = TrackingState::kPredicted;
  } else if (const bool could_start = can_start(frame, hint);
             could_start && ++frames_unrecognised_ == settings_.tracker.new_submap_after_lost) {
    return initialise(std::move(frame), hint.T_camera_start);
  } else {
    ++frames_lost_;
    state_ = frames_lost_ <= settings_.tracker.recently_lost_frames ? TrackingState::kRecentlyLost
                                                                    : TrackingState::kLost;
    last_.velocity.reset();
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
  if (!is_poor_fit(frame)) {
    last_fit_ = frame.timestamp;
  } else if (last_fit_ && frame.timestamp - *last_fit_ <= kLongest) {
    ++doubts_[frame.doubt = PoseDoubt::kPoorFit];
    frame.state = TrackingState::kRecentlyLost;
    drop_pose(frame);
  }
}

bool Tracker::can_start(const TrackedFrame& frame, const FrameHint& hint) {
  const ObservedFrame& view = *frame.view;
  constexpr float kSure = 0.2F;  // of the depth: of such points landmarks are made
  int known = 0;
  for (std::size_t i = 0; i < view.size(); ++i) known += view.has_depth(i, kSure) && !view.may_move(i) ? 1 : 0;
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
TrackedFrame Tracker::initialise(TrackedFrame frame, const SE3& T_camera_world) {
  frame.T_camera_world = T_camera_world;
  frame.doubt = PoseDoubt::kNone;
  frame.landmarks.assign(frame.view->size(), {});
  frame.reference = {};
  frame.inliers = 0;
  frame.quality = 1.0;
  frame.state = state_ = TrackingState::kTracking;
  frames_lost_ = frames_unrecognised_ = 0;
  relocaliser_.restart();
  last_.velocity.reset();
  waits_since_.reset();
  last_ = {frame, {}, {}};
  tentative_.restart();
  return frame;
}

std::optional<SE3> Tracker::predicted_pose(double timestamp) const {
  const bool is_known = state_ == TrackingState::kTracking || state_ == TrackingState::kPredicted;
  if (!is_known || map_.keyframe_count() == 0) return std::nullopt;
  return motion_.predict(last_, timestamp);
}

// The candidates by predictions are tried first. Where they are refused, or few inliers support the best, the
// reference keyframe, by descriptors, and the last frame, in a wide search, give others.
bool Tracker::follow(TrackedFrame& frame, const FrameHint& hint) {
  if (!last_.frame.reference.is_valid()) return false;
  const Stopwatch watch;
  const SE3 T_world_last = last_pose()->inverse();
  const std::vector<SE3> predicted = predictions(frame.timestamp, hint.T_camera_world);
  std::vector<PoseCandidate> candidates;
  const auto add = [&](std::optional<PoseCandidate> candidate) {
    if (candidate) candidates.push_back(std::move(*candidate));
  };
  bool is_trusted = false;
  for (const SE3& pose : predicted) {
    add(initial_pose_.from_last_frame(*frame.view, last_.frame, T_world_last, pose, {1.0F, rested_}));
    is_trusted |=
        !candidates.empty() && candidates.back().inliers - of_tentative(candidates.back().landmarks) >=
                                   settings_.tracker.trusted_inliers;
  }
  times_.match_frame += watch.seconds();
  if (is_trusted && accept_best(frame, std::exchange(candidates, {}), hint)) return true;
  const Stopwatch second_watch;
  if (const Keyframe* reference = map_.find(last_.frame.reference))
    add(initial_pose_.from_keyframe(*frame.view, *reference, T_world_last.inverse()));
  constexpr float kWider = 3.0F;
  add(initial_pose_.from_last_frame(*frame.view, last_.frame, T_world_last,
                                    predicted.empty() ? T_world_last.inverse() : predicted.front(),
                                    {kWider, rested_}));
  // Tentative poses may be the fault: from the last one before them.
  if (const TrackedState* confirmed = confirmed_here(last_.frame.reference, frame.timestamp)) {
    const SE3 T_camera_world = *confirmed->T_camera_world(map_);
    add(initial_pose_.from_last_frame(*frame.view, confirmed->frame, T_camera_world.inverse(), T_camera_world,
                                      {kWider, rested_}));
  }
  times_.match_frame += second_watch.seconds();
  return accept_best(frame, std::move(candidates), hint);
}

// Refines the candidates with the local map, those with most inliers first, until one is accepted.
bool Tracker::accept_best(TrackedFrame& frame, std::vector<PoseCandidate> candidates, const FrameHint& hint) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.inliers > b.inliers; });
  const KeyframeId near = map_.T_camera_anchor(last_.frame.reference).first;
  for (PoseCandidate& candidate : candidates) {
    refine_with_local_map(frame, std::move(candidate), near, hint.depth);
    if (is_accepted(frame, settings_.tracker.min_inliers)) return true;
  }
  return false;
}

PoseDoubt Tracker::doubt_of(const TrackedFrame& frame, int min_inliers) const {
  if (frame.inliers < min_inliers) return PoseDoubt::kFewInliers;
  if (frame.inliers < settings_.plausible.min_found_share * frame.visible) return PoseDoubt::kFewFound;
  const PoseDoubt uncertain = check_certainty(frame.measurement_covariance, settings_.plausible);
  return uncertain != PoseDoubt::kNone ? uncertain : motion_.doubt(last_, frame);
}

// A pose is not refused because it does not fit tentative ones, if it is strong and fits those before.
bool Tracker::is_accepted(TrackedFrame& frame, int min_inliers) {
  const PoseDoubt doubt = doubt_of(frame, min_inliers);
  frame.doubt = doubt;
  const bool is_by_motion = doubt == PoseDoubt::kSpeed || doubt == PoseDoubt::kAcceleration ||
                            doubt == PoseDoubt::kTurnRate || doubt == PoseDoubt::kGyroscope;
  const TrackedState* confirmed =
      is_by_motion && is_strong(frame) ? confirmed_here(frame.reference, frame.timestamp) : nullptr;
  is_contradiction_ = confirmed != nullptr && motion_.doubt(*confirmed, frame) == PoseDoubt::kNone;
  if (is_contradiction_) {
    frame.doubt = PoseDoubt::kNone;
    return true;
  }
  if (doubt != PoseDoubt::kNone) ++doubts_[doubt];
  if (doubt == PoseDoubt::kGyroscope && is_strong(frame)) motion_.note_refusal();
  return doubt == PoseDoubt::kNone;
}

// The last pose before tentative ones, if there are such and it is in the submap of a keyframe.
const TrackedState* Tracker::confirmed_here(KeyframeId keyframe, double timestamp) const {
  const TrackedState* confirmed = tentative_.confirmed(timestamp);
  const bool is_here = confirmed != nullptr && is_same_submap(map_, confirmed->frame.reference, keyframe);
  return is_here ? confirmed : nullptr;
}

// By optical flow, by the gyroscope and by the motion model, those that differ. Each may be wrong: flow on
// repeated structure, the gyroscope by its mounting, the motion model where the motion changes.
std::vector<SE3> Tracker::predictions(double timestamp, const std::optional<SE3>& by_flow) const {
  std::vector<SE3> result;
  if (by_flow) result.push_back(*by_flow);
  const SE3 T_world_last = last_pose()->inverse();
  const auto add = [&](const SE3& predicted) {
    const bool is_new = std::none_of(result.begin(), result.end(), [&](const SE3& other) {
      return initial_pose_.disagreement(last_.frame, T_world_last, other, predicted) <
             settings_.matcher.frame_radius;
    });
    if (is_new) result.push_back(predicted);
  };
  if (const auto turned = motion_.by_gyroscope(last_, timestamp)) add(*turned);
  if (last_.velocity) add(motion_.by_velocity(last_, timestamp));
  return result;
}

std::optional<SE3> Tracker::last_pose() const { return last_.T_camera_world(map_); }

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

// Of the keyframes that share most landmarks with the frame. used: points of the frame.
RestingPoints Tracker::resting_points(const TrackedFrame& frame, const std::vector<std::uint32_t>& used) {
  constexpr std::size_t kKeyframes = 3;
  const ObservedFrame& view = *frame.view;
  if (settings_.resting_weight <= 0.0 || view.is_movable.empty()) return {{}, 0.0, rested_};
  std::vector<KeyframeId> keyframes = local_map_.keyframes();
  keyframes.resize(std::min(keyframes.size(), kKeyframes));
  RestingPoints resting{
      match_resting_points(map_, camera_, keyframes, view, *frame.T_camera_world, used, matcher_),
      settings_.resting_weight, rested_};
  // All of them together count no more than what is static.
  const auto all = static_cast<double>(std::max<std::size_t>(1, resting.points.size()));
  resting.weight = std::min(resting.weight, static_cast<double>(used.size()) / all);
  return resting;
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
  const RestingPoints resting = resting_points(frame, points);
  const OptimisedPose pose =
      optimise_frame(camera_, map_, *frame.view, points, positions, *frame.T_camera_world, settings_.noise,
                     settings_.pose, frame.landmarks, resting);
  frame.T_camera_world = pose.T_camera_world;
  frame.measurement_covariance = pose.covariance;
  frame.pixel_error_scale = pose.pixel_error_scale;
  frame.inliers = pose.inliers;
  times_.optimise += watch.seconds();
}

// While dynamic objects hide the scene, the pose is extrapolated with the motion model for a limited time.
bool Tracker::predict_hidden(TrackedFrame& frame, const FrameHint& hint) {
  const bool is_hidden = hint.hidden_share >= settings_.tracker.hidden_share;
  if (!is_hidden || frame.timestamp - last_.frame.timestamp > settings_.tracker.max_predicted) return false;
  frame.T_camera_world = motion_.predict(last_, frame.timestamp);
  frame.covariance =
      PoseCovariance::of_prediction(last_.frame.covariance, *frame.T_camera_world * last_pose()->inverse(),
                                    frame.timestamp - last_.frame.timestamp);
  frame.reference = last_.frame.reference;
  frame.inliers = 0;
  frame.landmarks.assign(frame.view->size(), {});
  return true;
}

bool Tracker::relocalise(TrackedFrame& frame, const FrameHint& hint) {
  const Stopwatch watch;
  const auto similar = hint.similar_keyframes ? hint.similar_keyframes() : std::vector<KeyframeId>{};
  // No prior on the pose: lost for long, or no frame tracked yet in a loaded map.
  const bool search_all =
      last_.frame.view == nullptr || frames_lost_ >= settings_.tracker.recently_lost_frames;
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

bool Tracker::is_poor_fit(const TrackedFrame& frame) const {
  return frame.pixel_error_scale > settings_.plausible.max_pixel_error &&
         frame.inliers < settings_.plausible.poor_found_share * frame.visible;
}

// How many landmarks came into the map by tentative poses, which they do not confirm.
int Tracker::of_tentative(const std::vector<LandmarkId>& landmarks) const {
  if (tentative_.keyframes().empty()) return 0;
  return static_cast<int>(std::count_if(landmarks.begin(), landmarks.end(), [&](LandmarkId id) {
    const Landmark* landmark = id.is_valid() ? map_.find(id) : nullptr;
    return landmark != nullptr && tentative_.made(landmark->created_by);
  }));
}

bool Tracker::is_strong(const TrackedFrame& frame) const {
  return frame.inliers - of_tentative(frame.landmarks) >= settings_.tracker.trusted_inliers &&
         !is_poor_fit(frame);
}

// Tentative poses are withdrawn once a strong one contradicts them: it does not fit their motion, or the
// image of the last of them, matched with this one, fits another pose better.
void Tracker::reconsider(TrackedFrame& frame) {
  if (confirmed_here(frame.reference, frame.timestamp) == nullptr || !is_strong(frame)) return;
  if (!is_contradiction_ && !contradicts_last(frame)) return;
  last_ = *tentative_.confirmed(frame.timestamp);
  frame.withdrawal = tentative_.withdraw();
  motion_.forget_rotation();
  const auto& wrong = frame.withdrawal->keyframes;
  if (std::find(wrong.begin(), wrong.end(), frame.reference) != wrong.end())
    frame.reference = frame.withdrawal->confirmed;
}

// The last pose is searched for between those of this frame and of the last one that is not tentative.
bool Tracker::contradicts_last(const TrackedFrame& frame) {
  const TrackedState& confirmed = *tentative_.confirmed(frame.timestamp);
  if (confirmed_here(last_.frame.reference, frame.timestamp) == nullptr) return false;
  const double begin = confirmed.frame.timestamp;
  const double share = (last_.frame.timestamp - begin) / (frame.timestamp - begin);
  const SE3 before = *confirmed.T_camera_world(map_);
  const SE3 between = SE3::exp(share * (*frame.T_camera_world * before.inverse()).log()) * before;
  const auto matched_around = [&](const SE3& predicted, float radius_factor) {
    return initial_pose_.from_last_frame(*last_.frame.view, frame, frame.T_camera_world->inverse(), predicted,
                                         {radius_factor, rested_});
  };
  const auto other = matched_around(between, 3.0F);
  if (!other) return false;
  // A wrong step of evaluations, beyond three sigmas.
  constexpr double kFar = 0.08;                               // metres
  constexpr double kTurned = 4.0 * std::numbers::pi / 180.0;  // radians
  const SE3 last = *last_pose();
  const SE3 off = other->T_camera_world * last.inverse();
  const double sigma = std::sqrt(last_.frame.measurement_covariance.topLeftCorner<3, 3>().trace());
  if (off.translation().norm() < kFar + 3.0 * sigma && off.angle() < kTurned) return false;
  // Repeated structure may fit two poses equally.
  constexpr double kBetter = 1.2;  // times as many inliers
  const auto same = matched_around(last, 1.0F);
  return !same || other->inliers > kBetter * same->inliers;
}

// The pose of an earlier frame by its landmarks as they are now. Where mapping has moved them, it does not
// move with its reference alone.
SE3 Tracker::measured_again(const TrackedState& state) const {
  constexpr double kSame = 1e-6;  // metres, radians
  const SE3 T_camera_world = *state.T_camera_world(map_);
  const SE3 moved = T_camera_world * state.frame.T_camera_world->inverse();
  bool has_moved = moved.translation().norm() > kSame || moved.angle() > kSame;
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::uint32_t> points;
  std::vector<LandmarkId> landmarks(state.frame.landmarks.size());
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const LandmarkId id = map_.resolve(state.frame.landmarks[i]);
    const Landmark* landmark = id.is_valid() ? map_.find(id) : nullptr;
    if (landmark == nullptr) continue;
    landmarks[i] = id;
    positions.push_back(landmark->position);
    points.push_back(i);
    has_moved |= landmark->position != state.positions[i];
  }
  if (!has_moved || static_cast<int>(points.size()) < settings_.tracker.trusted_inliers)
    return T_camera_world;
  const OptimisedPose pose = optimise_frame(camera_, map_, *state.frame.view, points, positions,
                                            T_camera_world, settings_.noise, settings_.pose, landmarks, {});
  return pose.inliers >= settings_.tracker.trusted_inliers ? pose.T_camera_world : T_camera_world;
}

void Tracker::remember(TrackedFrame& frame) {
  if (is_same_submap(map_, last_.frame.reference, frame.reference))
    frame.motion = {last_.frame.timestamp, *frame.T_camera_world * measured_again(last_).inverse()};
  const auto velocity = motion_.velocity(last_, frame);
  last_ = {frame, *frame.T_camera_world * map_.T_camera_world(frame.reference).inverse(), velocity};
  note_positions();
  motion_.learn(last_);
  const TrackedState* confirmed = tentative_.confirmed(frame.timestamp);
  if (confirmed != nullptr && confirmed_here(frame.reference, frame.timestamp) == nullptr)
    tentative_.restart();
  tentative_.add(last_, is_strong(frame));
}

void Tracker::note_positions() {
  last_.positions.assign(last_.frame.landmarks.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < last_.positions.size(); ++i) {
    const LandmarkId id = last_.frame.landmarks[i];
    if (const Landmark* landmark = id.is_valid() ? map_.find(id) : nullptr)
      last_.positions[i] = landmark->position;
  }
}

void Tracker::keyframe_created(KeyframeId id) {
  const Keyframe& keyframe = *map_.find(id);
  covariance_.add_keyframe(id, last_.frame.covariance);
  last_.frame.reference = id;
  last_.frame.landmarks = keyframe.landmarks;
  last_.T_camera_reference = SE3();
  note_positions();
  tentative_.add_keyframe(id);
}

void Tracker::restart_clock(double timestamp) {
  last_.velocity.reset();
  waits_since_.reset();
  last_fit_.reset();
  tentative_.restart();
  motion_.restart_clock();
  last_.frame.timestamp = timestamp;
}

}  // namespace roslam
