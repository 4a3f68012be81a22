// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "roslam/geometry/trajectory.hpp"
#include "simulation/composition/composer_options.hpp"
#include "simulation/composition/random_stream.hpp"

namespace roslam::simulation {

/// The floor that people walk on, and which part of it the camera sees at a time. World frame, metres.
class WalkingGround {
 public:
  /// Position and viewing direction of the camera on the floor, averaged over a few seconds.
  struct Gaze {
    Eigen::Vector3d foot;     ///< the point of the floor below the camera
    Eigen::Vector3d forward;  ///< unit vectors along the floor
    Eigen::Vector3d right;
  };

  /// poses: of the camera over the whole sequence, at least one. Throws OptionsError if options.up is not
  /// given and the camera's orientations do not determine it.
  WalkingGround(const Trajectory& poses, const ComposerOptions& options);

  Gaze gaze(double time) const;

  const Eigen::Vector3d& up() const { return up_; }
  double start() const { return poses_.front().timestamp; }
  double end() const { return poses_.back().timestamp; }

 private:
  Trajectory poses_;
  Eigen::Vector3d up_;
  double floor_;  // height of the floor along up
};

/// A person's path over the floor: straight from one goal to the next at constant speed, with pauses at some
/// of them. Goals lie in view of the camera at the time of arrival, so that people stay in view of a moving
/// camera.
class Walk {
 public:
  Walk(const WalkingGround& ground, const ComposerOptions& options, RandomStream& random);

  /// Position of the feet, world frame, metres; up to two centimetres above the floor in mid-step.
  Eigen::Vector3d feet(double time) const;

  /// True if the person walks at that time.
  bool is_walking(double time) const;

 private:
  struct Leg {
    double start;  // seconds
    double end;
    Eigen::Vector3d from;  // on the floor
    Eigen::Vector3d to;
  };
  const Leg& leg_at(double time) const;

  Eigen::Vector3d up_;
  std::vector<Leg> legs_;
};

}  // namespace roslam::simulation
