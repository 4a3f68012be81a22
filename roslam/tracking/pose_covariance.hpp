// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

/// Covariance of the same pose by T_world_camera: (position, rotation vector) in the world frame (metres,
/// radians). by_camera: perturbation of T_camera_world from the left, in the camera frame.
ROSLAM_EXPORT Matrix6d covariance_in_world(const SE3& T_world_camera, const Matrix6d& by_camera);

/// A perturbation of one camera's pose as one of another that moves with it, T_b_a apart.
ROSLAM_EXPORT Matrix6d carried(const Matrix6d& covariance_of_a, const SE3& T_b_a);

/// The uncertainty of poses against the origin of their submap, by propagation from keyframe to keyframe. The
/// error of a landmark is that of the keyframe that created it, so a pose has the mean error of the keyframes
/// that created the landmarks it was measured by, and the error of the measurement itself. Errors of these
/// keyframes count as equal where they are not known apart, as they share most of their past. Improvements by
/// bundle adjustment are not counted, nor are errors that all images share, as of the calibration.
/// Covariances are of perturbations of T_camera_world from the left, in the camera frame. Not thread safe.
class PoseCovariance {
 public:
  /// Of a frame's pose. landmarks: those that support it; by_measurement: as if these were exact, and all
  /// errors independent (OptimisedPose::covariance).
  Matrix6d of_frame(const Map& map, const SE3& T_camera_world, std::span<const LandmarkId> landmarks,
                    const Matrix6d& by_measurement) const;

  /// Of the measurement of a pose alone, with errors as they are. by_measurement: as in of_frame().
  static Matrix6d of_measurement(const Matrix6d& by_measurement);

  /// Of a pose that was extrapolated over so many seconds from one of that covariance.
  static Matrix6d of_prediction(const Matrix6d& last, const SE3& T_camera_last, double seconds);

  /// The frame became a keyframe.
  void add_keyframe(KeyframeId keyframe, const Matrix6d& covariance);

 private:
  std::vector<Matrix6d> keyframes_;  // by id; zero where unknown, as of a map that was loaded
};

}  // namespace roslam
