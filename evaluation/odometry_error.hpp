// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/statistics.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/odometry/odometry.hpp"

namespace roslam::evaluation {

/// How well odometry serves a controller. With true body poses Q_i, odometry P_i (T_odom_body) and
/// consecutive frames i, j of one value of the reset counter, the error of a step is (Q_i^-1 Q_j)^-1 (P_i^-1
/// P_j). The true velocity is the central difference of the true poses one frame before and after, in the
/// body frame.
struct OdometryError {
  std::size_t frames = 0;    ///< of odometry
  std::size_t compared = 0;  ///< frames whose true velocity is known
  std::size_t resets = 0;    ///< of the counter
  Statistics step;           ///< metres
  Statistics step_rotation;  ///< degrees
  Statistics velocity;       ///< m/s
  Statistics turn_rate;      ///< degrees/s

  /// Normalised estimation error squared of the velocity (6 degrees of freedom: its mean is 6 where the
  /// covariance is right), and the share of frames below and above the two-sided 99 % bounds of chi-squared.
  double nees = 0.0;
  double below_bounds = 0.0;
  double above_bounds = 0.0;

  /// By how many seconds the true velocity has to be shifted to fit best; nothing where the velocity changes
  /// too little to tell: one frame's shift adds less than a quarter to the mean squared error.
  std::optional<double> delay;

  /// The largest jump of the pose in the map between two frames that T_map_odom carries and odom does not,
  /// metres.
  double largest_correction = 0.0;

  /// Between the z axes of the map and of the truth, by the mean rotation between them, degrees.
  double tilt = 0.0;
};

/// truth: camera poses, T_world_camera. Throws InputError if fewer than ten frames lie within the truth,
/// which is interpolated where its poses are no more than 0.2 s apart.
OdometryError evaluate_odometry(const Trajectory& truth, const std::vector<Odometry>& odometry,
                                const SE3& T_body_camera);

struct EvaluatedOdometry {
  std::string name;
  OdometryError error;
};

/// A Markdown table that also reads well as plain text.
std::string to_markdown(const std::vector<EvaluatedOdometry>& runs);

/// One JSON object; keys end in their unit; null where there is no value.
std::string to_json(const std::vector<EvaluatedOdometry>& runs);

}  // namespace roslam::evaluation
