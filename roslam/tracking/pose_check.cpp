// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/pose_check.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "roslam/common/error.hpp"

namespace roslam {

void PlausibilityOptions::validate() const {
  if (!(min_found_share >= 0.0 && min_found_share < 1.0))
    throw OptionsError("plausible.min_found_share must be 0 to 1");
  if (!(poor_found_share >= 0.0 && poor_found_share <= 1.0))
    throw OptionsError("plausible.poor_found_share must be 0 to 1");
  if (!(max_pixel_error > 0.0)) throw OptionsError("plausible.max_pixel_error must be positive (sigmas)");
  if (!(max_position_sigma > 0.0))
    throw OptionsError("plausible.max_position_sigma must be positive (metres)");
  if (!(max_rotation_sigma > 0.0))
    throw OptionsError("plausible.max_rotation_sigma must be positive (degrees)");
  if (!(constrained_sigma > 0.0 && constrained_sigma <= max_position_sigma))
    throw OptionsError("plausible.constrained_sigma must be above 0 and at most max_position_sigma (metres)");
  if (!(max_speed > 0.0)) throw OptionsError("plausible.max_speed must be positive (m/s)");
  if (!(max_acceleration > 0.0)) throw OptionsError("plausible.max_acceleration must be positive (m/s^2)");
  if (!(max_turn_rate > 0.0)) throw OptionsError("plausible.max_turn_rate must be positive (degrees/s)");
}

std::string_view describe(PoseDoubt doubt) {
  switch (doubt) {
    case PoseDoubt::kNone:
      return "none";
    case PoseDoubt::kFewInliers:
      return "too few landmarks agree";
    case PoseDoubt::kFewFound:
      return "too few of the landmarks in view are found";
    case PoseDoubt::kUncertain:
      return "the landmarks hardly constrain it";
    case PoseDoubt::kPoorFit:
      return "few of the landmarks in view are found, and not well";
    case PoseDoubt::kSpeed:
      return "the speed is not plausible";
    case PoseDoubt::kAcceleration:
      return "the acceleration is not plausible";
    case PoseDoubt::kTurnRate:
      return "the turn rate is not plausible";
    case PoseDoubt::kGyroscope:
      return "the gyroscope contradicts";
  }
  return "unknown";
}

double largest_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, covariance.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff()));
}

PoseDoubt check_certainty(const Matrix6d& covariance, const PlausibilityOptions& options) {
  const double position = largest_sigma(covariance.topLeftCorner<3, 3>());
  const double rotation = largest_sigma(covariance.bottomRightCorner<3, 3>()) * 180.0 / std::numbers::pi;
  const bool is_certain = position <= options.max_position_sigma && rotation <= options.max_rotation_sigma;
  return is_certain ? PoseDoubt::kNone : PoseDoubt::kUncertain;
}

std::vector<Eigen::Vector3d> unconstrained_directions(const Matrix6d& covariance,
                                                      const PlausibilityOptions& options) {
  const Eigen::Matrix3d position = covariance.topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solved(position);
  std::vector<Eigen::Vector3d> result;
  for (int i = 2; i >= 0; --i) {
    if (solved.eigenvalues()[i] > options.constrained_sigma * options.constrained_sigma)
      result.push_back(solved.eigenvectors().col(i));
  }
  return result;
}

PoseDoubt check_motion(const MotionState& last, double timestamp, const SE3& T_world_camera, double sigma,
                       const PlausibilityOptions& options) {
  const double elapsed = timestamp - last.timestamp;
  if (!(elapsed > 0.0)) return PoseDoubt::kNone;
  constexpr double kLeastSigma = 0.01;  // metres; the covariance does not contain all errors
  const double noise = 3.0 * std::hypot(std::max(sigma, kLeastSigma), std::max(last.sigma, kLeastSigma));
  const Eigen::Vector3d moved = T_world_camera.translation() - last.T_world_camera.translation();
  if (moved.norm() > options.max_speed * elapsed + noise) return PoseDoubt::kSpeed;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  constexpr double kNoiseOfTurn = 3.0;  // degrees
  const double turned = (last.T_world_camera.inverse() * T_world_camera).angle() * kDegrees;
  if (turned > options.max_turn_rate * elapsed + kNoiseOfTurn) return PoseDoubt::kTurnRate;
  if (!last.velocity) return PoseDoubt::kNone;
  // The velocity is a difference of poses, too: its noise counts once more.
  const double off = (moved - *last.velocity * elapsed).norm();
  if (off > options.max_acceleration * elapsed * elapsed + 2.0 * noise) return PoseDoubt::kAcceleration;
  return PoseDoubt::kNone;
}

}  // namespace roslam
