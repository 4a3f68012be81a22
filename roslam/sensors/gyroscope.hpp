// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <deque>
#include <optional>
#include <span>

#include "roslam/geometry/imu_calibration.hpp"
#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// How a camera turned between two times, by its gyroscope.
struct Turn {
  Eigen::Quaterniond R_to_from;  ///< maps directions in the camera frame of the first time to the second's
  Eigen::Matrix3d covariance;    ///< rad^2, of the perturbation from the left: exp(x) R_to_from
};

/// Integrates the turn rates of a gyroscope and estimates their bias: a Kalman filter whose state is the
/// bias, a random walk, and whose measurements are rotations of the camera by its images, each compared with
/// the integrated one (the rotational part of preintegration: Forster et al., On-Manifold Preintegration for
/// Real-Time Visual-Inertial Odometry, T-RO 2017, section VI). Not thread safe.
class Gyroscope {
 public:
  /// Throws as ImuCalibration::validate does.
  explicit Gyroscope(const ImuCalibration& calibration);

  /// Samples in the order of time, up to that of a frame (seconds). Those that are not finite, impossibly
  /// fast, not later than the last or later than the frame are skipped and counted. Keeps the newest seconds
  /// only.
  void add(std::span<const InertialSample> samples, double frame_time);

  /// The rotation between two times; nothing where samples are missing between them.
  std::optional<Turn> turn(double from, double to) const;

  /// A rotation between two times as the images show it, to estimate the bias by.
  void correct(double from, double to, const Turn& seen);

  /// To be called when a pose that the images support was refused as it contradicts.
  void note_refusal();

  /// Whether a rotation contradicts that of the gyroscope, by what is known of its bias.
  bool contradicts(double from, double to, const Turn& seen) const;

  GyroscopeState state() const;

  /// False while most rotations by images contradict it, as with a wrong T_camera_imu or a clock of its own.
  bool agrees_with_images() const { return disagreement_ < kMostDisagree; }

  /// Forgets the samples, as after a reset of the clock; keeps the bias.
  void restart_clock() { samples_.clear(); }

 private:
  static constexpr double kMostDisagree = 0.5;

  struct Integral {
    Eigen::Quaterniond R_from_to;  // in the frame of the IMU
    Eigen::Matrix3d by_bias;       // R_from_to(b + d) = R_from_to(b) exp(-by_bias d)
  };
  struct Comparison {
    Eigen::Vector3d residual;
    Eigen::Matrix3d by_bias;  // derivative of the residual with respect to the bias
    Eigen::Matrix3d noise;    // covariance of the residual, without that of the bias
    double squared;           // Mahalanobis distance
  };

  std::optional<Integral> integrate(double from, double to) const;
  std::optional<Comparison> compare(double from, double to, const Turn& seen) const;
  void forget_bias();

  ImuCalibration calibration_;
  Eigen::Quaterniond R_camera_imu_;
  std::deque<InertialSample> samples_;
  Eigen::Vector3d bias_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  double disagreement_ = 0.0;  // moving average of contradictions
  std::size_t used_ = 0;
  std::size_t skipped_ = 0;
};

}  // namespace roslam
