// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// A pose and how it changes.
struct FilteredMotion {
  SE3 T_odom_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();   ///< of the body in the odom frame, m/s
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();  ///< in the body frame, rad/s

  /// Of (position in odom, rotation vector in odom, velocity in odom, turn rate in the body frame), where the
  /// rotation is exp(x) R_odom_body.
  Matrix12d covariance = Matrix12d::Identity();

  /// Of the motion since the pose before: (position, rotation vector) in odom.
  Matrix6d step_covariance = Matrix6d::Zero();
};

/// Filters poses into a smooth motion: extended Kalman filters of constant velocity and turn rate, with white
/// accelerations of three densities, from a calm flight to gusts, as interacting multiple models (Bar-Shalom,
/// Li, Kirubarajan: Estimation with Applications to Tracking and Navigation, 2001, section 11.6.6). A calm
/// flight is smoothed much, a gust is followed without delay. Not thread safe.
class MotionFilter {
 public:
  /// Begins at a pose whose velocity is not known. covariance: of (position, rotation vector) in odom.
  void start(double timestamp, const SE3& T_odom_body, const Matrix6d& covariance);

  /// To a later time (seconds), without a measurement.
  void predict(double timestamp);

  /// A measurement of the pose at the time predicted to. covariance: of its noise, as in start().
  void update(const SE3& T_odom_body, const Matrix6d& covariance);

  const FilteredMotion& state() const { return combined_; }
  double timestamp() const { return timestamp_; }

 private:
  static constexpr std::size_t kModels = 3;
  struct Model {
    FilteredMotion state;
    double probability = 1.0 / kModels;
    Matrix6d before = Matrix6d::Zero();  // covariance of the pose before the last prediction
    Eigen::Matrix<double, 6, 12> cross = Eigen::Matrix<double, 6, 12>::Zero();  // of that pose with the state
  };

  void mix();
  static void predict(Model& model, std::size_t index, double dt);
  static double update(Model& model, const SE3& T_odom_body, const Matrix6d& covariance);
  void combine();

  std::array<Model, kModels> models_;
  FilteredMotion combined_;
  double timestamp_ = 0.0;
};

}  // namespace roslam
