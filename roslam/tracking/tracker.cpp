// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"

namespace roslam {

namespace {
// Marks matches with points of the last frame that have no landmark (ORB-SLAM's temporal points): they are
// used for the pose of this frame only.
constexpr LandmarkId kUnmapped{LandmarkId::kNone - 1};

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
      local_map_(settings.local_map),
      relocaliser_(settings.relocaliser,
                   GeometricVerifier(camera, {settings.geometric_verifier, settings.matcher, settings.pose,
                                              settings.noise})) {
  settings.tracker.validate();
  settings.matcher.validate();
  settings.pose.validate();
  settings.local_map.validate();
  settings.relocaliser.validate();
  settings.noise.validate();
}

TrackedFrame Tracker::track(std::shared_ptr<const ObservedFrame> view, double timestamp,
                            const FrameHint& hint) {
  times_ = {};
  unmapped_points_.clear();
  unmapped_positions_.clear();
  TrackedFrame frame;
  frame.timestamp = timestamp;
  frame.landmarks.resize(view->size());
  frame.view = std::move(view);
  if (map_.keyframe_count() == 0) {
    return can_start(frame, hint) ? initialise(std::move(frame)) : frame;
  }

  const bool was_known = state_ == TrackingState::kTracking || state_ == TrackingState::kPredicted;
  const bool found = (was_known && follow(frame, hint.T_camera_world)) || relocalise(frame, hint);
  if (found) {
    state_ = TrackingState::kTracking;
    frames_lost_ = frames_unrecognised_ = 0;
    waits_since_.reset();
    relocaliser_.restart();
    frame.quality = std::min(1.0, frame.inliers / static_cast<double>(settings_.tracker.trusted_inliers));
    count_found(frame);
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
    frame.T_camera_world.reset();
    frame.inliers = 0;
    frame.landmarks.assign(frame.view->size(), {});
  }
  frame.state = state_;
  return frame;
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

bool Tracker::follow(TrackedFrame& frame, const std::optional<SE3>& T_camera_world) {
  const SE3 predicted = T_camera_world.value_or(predict_pose(frame.timestamp));
  constexpr float kWider = 3.0F;
  // Without a motion estimate a search around the projection may match wrong points: match by descriptors.
  const bool matched = ((velocity_ || T_camera_world) && match_last_frame(frame, predicted, 1.0F)) ||
                       match_reference(frame) || match_last_frame(frame, predicted, kWider);
  return matched && last_.reference.is_valid() &&
         refine_with_local_map(frame, map_.T_camera_anchor(last_.reference).first);
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

bool Tracker::match_last_frame(TrackedFrame& frame, const SE3& predicted, float radius_factor) {
  const Stopwatch watch;
  frame.landmarks.assign(frame.view->size(), {});
  const SE3 T_world_last = last_pose()->inverse();
  const ObservedFrame& last = *last_.view;
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::uint32_t> points;
  std::vector<float> rotations;
  for (std::size_t i = 0; i < last.size(); ++i) {
    const LandmarkId id = map_.resolve(last_.landmarks[i]);
    const Landmark* landmark = map_.find(id);
    if (landmark == nullptr && last.depths[i] <= 0.0F) continue;
    const Eigen::Vector3d position =
        landmark != nullptr ? landmark->position
                            : T_world_last * camera_.unproject(last.pixels[i].cast<double>(), last.depths[i]);
    const Eigen::Vector3d in_camera = predicted * position;
    if (in_camera.z() <= 0.0) continue;
    const Eigen::Vector2f pixel = camera_.project(in_camera).cast<float>();
    if (!frame.view->grid.contains(pixel)) continue;
    const int level = last.levels[i];
    const float radius =
        radius_factor * static_cast<float>(settings_.matcher.frame_radius) * map_.scale(level);
    const int match = matcher_.find({pixel, radius, level - 1, level + 1, static_cast<float>(in_camera.z()),
                                     settings_.matcher.max_distance, false},
                                    last.descriptors[i], *frame.view, frame.landmarks);
    if (match < 0) continue;
    frame.landmarks[static_cast<std::size_t>(match)] = landmark != nullptr ? id : kUnmapped;
    positions.push_back(position);
    points.push_back(static_cast<std::uint32_t>(match));
    rotations.push_back(last.angles[i] - frame.view->angles[static_cast<std::size_t>(match)]);
  }
  const auto keep = consistent_rotation(rotations);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (keep[k]) {
      positions[kept] = positions[k];
      points[kept++] = points[k];
    } else {
      frame.landmarks[points[k]] = {};
    }
  }
  positions.resize(kept);
  points.resize(kept);
  times_.match_frame += watch.seconds();
  frame.T_camera_world = predicted;
  const bool good = first_estimate(frame, positions, points);
  unmapped_points_.clear();
  unmapped_positions_.clear();
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (frame.landmarks[points[k]] != kUnmapped) continue;
    unmapped_points_.push_back(points[k]);
    unmapped_positions_.push_back(positions[k]);
  }
  std::replace(frame.landmarks.begin(), frame.landmarks.end(), kUnmapped, LandmarkId{});
  return good;
}

bool Tracker::match_reference(TrackedFrame& frame) {
  const Keyframe* reference = map_.find(last_.reference);
  if (reference == nullptr) return false;
  const Stopwatch watch;
  std::vector<std::uint32_t> known;
  for (std::uint32_t i = 0; i < reference->landmarks.size(); ++i) {
    if (reference->landmarks[i].is_valid()) known.push_back(i);
  }
  frame.landmarks.assign(frame.view->size(), {});
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::uint32_t> points;
  for (const auto& [theirs, ours] :
       match_descriptors(*reference->view, known, *frame.view, settings_.matcher)) {
    frame.landmarks[ours] = reference->landmarks[theirs];
    positions.push_back(map_.find(reference->landmarks[theirs])->position);
    points.push_back(ours);
  }
  times_.match_frame += watch.seconds();
  frame.T_camera_world = last_pose();
  return first_estimate(frame, positions, points);
}

bool Tracker::first_estimate(TrackedFrame& frame, const std::vector<Eigen::Vector3d>& positions,
                             const std::vector<std::uint32_t>& points) {
  return estimate(frame, positions, points, settings_.tracker.min_frame_matches) &&
         frame.inliers >= settings_.tracker.min_agreement * static_cast<double>(points.size());
}

// Optimises the pose on matches of image points with world positions; unsets the landmarks of outliers.
bool Tracker::estimate(TrackedFrame& frame, const std::vector<Eigen::Vector3d>& positions,
                       const std::vector<std::uint32_t>& points, int min_inliers) {
  if (static_cast<int>(points.size()) < min_inliers) return false;
  const Stopwatch watch;
  const ObservedFrame& view = *frame.view;
  std::vector<PoseMeasurement> measurements(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::uint32_t i = points[k];
    measurements[k].point_world = positions[k];
    measurements[k].measurement = map_.measurement(view, i, settings_.noise);
  }
  const OptimisedPose pose = optimise_pose(camera_, measurements, *frame.T_camera_world, settings_.pose);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!pose.is_inlier[k]) frame.landmarks[points[k]] = {};
  }
  frame.T_camera_world = pose.T_camera_world;
  frame.inliers = pose.inliers;
  times_.optimise += watch.seconds();
  return pose.inliers >= min_inliers;
}

void Tracker::match_local_landmarks(TrackedFrame& frame) {
  std::vector<bool> is_matched(map_.landmark_slots(), false);
  for (const LandmarkId id : frame.landmarks) {
    if (id.is_valid()) is_matched[id.index()] = true;
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
  }
}

bool Tracker::refine_with_local_map(TrackedFrame& frame, KeyframeId near) {
  const Stopwatch watch;
  local_map_.update(map_, frame.landmarks, near);
  frame.reference = local_map_.reference();
  match_local_landmarks(frame);
  times_.match_map += watch.seconds();
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].is_valid()) continue;
    positions.push_back(map_.find(frame.landmarks[i])->position);
    points.push_back(i);
  }
  if (static_cast<int>(points.size()) < settings_.tracker.scarce_inliers) {
    for (std::size_t k = 0; k < unmapped_points_.size(); ++k) {
      if (frame.landmarks[unmapped_points_[k]].is_valid()) continue;
      frame.landmarks[unmapped_points_[k]] = kUnmapped;
      positions.push_back(unmapped_positions_[k]);
      points.push_back(unmapped_points_[k]);
    }
  }
  const bool good = estimate(frame, positions, points, settings_.tracker.min_inliers);
  std::replace(frame.landmarks.begin(), frame.landmarks.end(), kUnmapped, LandmarkId{});
  return good;
}

// While dynamic objects hide the scene, the pose is extrapolated with the motion model for a limited time.
bool Tracker::predict_hidden(TrackedFrame& frame, const FrameHint& hint) {
  const bool is_hidden = hint.hidden_share >= settings_.tracker.hidden_share;
  if (!is_hidden || frame.timestamp - last_.timestamp > settings_.tracker.max_predicted) return false;
  frame.T_camera_world = predict_pose(frame.timestamp);
  frame.reference = last_.reference;
  frame.inliers = 0;
  frame.landmarks.assign(frame.view->size(), {});
  return true;
}

bool Tracker::relocalise(TrackedFrame& frame, const FrameHint& hint) {
  const Stopwatch watch;
  unmapped_points_.clear();
  unmapped_positions_.clear();
  const auto similar = hint.similar_keyframes ? hint.similar_keyframes() : std::vector<KeyframeId>{};
  // No prior on the pose: lost for long, or no frame tracked yet in a loaded map.
  const bool search_all = last_.view == nullptr || frames_lost_ >= settings_.tracker.recently_lost_frames;
  const auto found = relocaliser_.find(map_, *frame.view, similar, search_all);
  times_.relocalise += watch.seconds();
  if (!found) return false;
  frame.T_camera_world = found->T_camera_world;
  frame.landmarks = found->landmarks;
  // A wrong relocalisation would corrupt the map: the local map must give twice the usual inliers.
  return refine_with_local_map(frame, found->matched_keyframe) &&
         frame.inliers >= 2 * settings_.tracker.min_inliers;
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
  last_.reference = id;
  last_.landmarks = keyframe.landmarks;
  T_last_reference_ = SE3();
}

void Tracker::restart_clock(double timestamp) {
  velocity_.reset();
  waits_since_.reset();
  last_.timestamp = timestamp;
}

}  // namespace roslam
