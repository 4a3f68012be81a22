// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/landmark_fit.hpp"

namespace roslam {

bool is_within_outlier_limit(const Map& map, const Keyframe& keyframe, std::uint32_t point,
                             const Eigen::Vector3d& position, const Camera& camera,
                             const MeasurementNoise& noise) {
  const Eigen::Vector3d in_camera = keyframe.T_camera_world * position;
  if (in_camera.z() <= 0.0) return false;
  const Measurement measurement = map.measurement(*keyframe.view, point, noise);
  return ReprojectionError{camera, measurement}.error(in_camera).squaredNorm() <= outlier_limit(measurement);
}

}  // namespace roslam
