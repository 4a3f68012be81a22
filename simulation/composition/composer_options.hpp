// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace roslam::simulation {

/// People composed into a recorded sequence, where they walk, and the noise of their depth.
struct ComposerOptions {
  std::size_t actors = 2;      ///< people in the scene at a time
  std::uint32_t seed = 1;      ///< of the choice of people, their walks and their depth noise
  double min_distance = 1.3;   ///< of walks, along the horizontal viewing direction of the camera, metres
  double max_distance = 2.4;   ///< metres
  double span = 1.2;           ///< of walks to each side of that direction, metres
  double camera_height = 1.3;  ///< of the camera above the floor, on average, metres
  std::optional<Eigen::Vector3d> up;  ///< world frame; nullopt: the mean up direction of the images
  double min_height = 1.6;            ///< of a person, metres
  double max_height = 1.85;           ///< metres
  double min_speed = 0.5;             ///< of a person who walks, metres a second
  double max_speed = 1.1;             ///< metres a second
  double thickness = 0.14;            ///< depth from the outline of a person to the nearest point, metres
  double noise_floor = 0.0012;        ///< standard deviation of the depth at 0.4 m, metres
  double noise_growth = 0.0019;       ///< of it, metres per squared metre beyond 0.4 m
  double shadow_baseline =
      0.075;  ///< from the depth camera to its projector on its right, metres; may be < 0

  /// Throws OptionsError naming the field that is out of its range.
  void validate() const;
};

}  // namespace roslam::simulation
