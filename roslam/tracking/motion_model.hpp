// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/sensors/gyroscope.hpp"
#include "roslam/tracking/pose_check.hpp"
#include "roslam/tracking/tentative_poses.hpp"

namespace roslam {

/// Whether both keyframes are valid and of one submap.
bool is_same_submap(const Map& map, KeyframeId a, KeyframeId b);

/// How the camera moves: predicts poses by constant velocity and, where the camera has one, by its gyroscope,
/// and says which motions are not plausible. Not thread safe; reads the map.
class MotionModel {
 public:
  /// use_gyroscope: if the camera has one.
  MotionModel(const Camera& camera, const Map& map, const PlausibilityOptions& plausible, bool use_gyroscope);

  /// Samples in the order of time, up to that of a frame (seconds); ignored without a gyroscope.
  void add_inertial(std::span<const InertialSample> samples, double frame_time);

  const std::optional<Gyroscope>& gyroscope() const { return gyroscope_; }

  /// T_camera_world at a later time (seconds), by the velocity of the state, if it has one. Constant at
  /// first, it decays exponentially: over many frames the model does not hold.
  SE3 by_velocity(const TrackedState& last, double timestamp) const;

  /// The same, turned as the gyroscope shows; nothing where samples are missing or the images contradict it.
  std::optional<SE3> by_gyroscope(const TrackedState& last, double timestamp) const;

  /// By the gyroscope if possible, else by the velocity.
  SE3 predict(const TrackedState& last, double timestamp) const;

  /// Twist of T_current_since per second; nothing after a long gap or in another submap.
  std::optional<Vector6d> velocity(const TrackedState& since, const TrackedFrame& frame) const;

  /// Whether the camera can have moved so since an earlier pose. Between submaps nothing is known, and the
  /// gyroscope is asked for half a second at most, as over more the drift of the map may differ.
  PoseDoubt doubt(const TrackedState& since, const TrackedFrame& frame) const;

  /// To be called when a pose that many landmarks support was refused for its rotation.
  void note_refusal() {
    if (gyroscope_) gyroscope_->note_refusal();
  }

  /// Takes a pose as measured, to learn the bias of the gyroscope by.
  void learn(const TrackedState& tracked);

  /// To be called when the pose that was learnt last is withdrawn.
  void forget_rotation() { learnt_until_.reset(); }

  /// To be called when the source's clock was reset.
  void restart_clock();

 private:
  Turn turn_since(const TrackedState& since, const TrackedFrame& frame) const;

  const Map& map_;
  PlausibilityOptions plausible_;
  std::optional<Gyroscope> gyroscope_;
  std::optional<TrackedState> learnt_until_;  // the pose that the next rotation to learn from begins at
};

}  // namespace roslam
