// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace roslam {

/// People who are put into a recorded sequence, where they walk, and how the depth camera sees them.
struct ComposerOptions {
  std::size_t actors = 2;      ///< people at a time
  std::uint32_t seed = 1;      ///< of who they are, how they walk, and the noise of their depth
  double min_distance = 1.3;   ///< of where they walk, in front of the camera along its level gaze, metres
  double max_distance = 2.4;   ///< metres
  double span = 1.2;           ///< how far they walk to each side of that gaze, metres
  double camera_height = 1.3;  ///< of the camera above the floor, on average, metres
  std::optional<Eigen::Vector3d>
      up;                        ///< in the world; nothing: the mean of what the camera's pictures have up
  double min_height = 1.6;       ///< of a person, metres
  double max_height = 1.85;      ///< metres
  double min_speed = 0.5;        ///< of a person who walks, metres a second
  double max_speed = 1.1;        ///< metres a second
  double thickness = 0.14;       ///< from the outline of a person to what is nearest to the camera, metres
  double noise_floor = 0.0012;   ///< deviation of the depth at 0.4 m, metres
  double noise_growth = 0.0019;  ///< metres, times the square of the metres beyond 0.4 m
  double shadow_baseline =
      0.075;  ///< from the depth camera to its projector on its right, metres; may be < 0

  /// Throws OptionsError naming the field that is out of its range.
  void validate() const;
};

}  // namespace roslam
