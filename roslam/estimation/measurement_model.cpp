// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/estimation/measurement_model.hpp"

#include "roslam/common/error.hpp"

namespace roslam {

void MeasurementNoise::validate() const {
  if (!(pixel_sigma > 0.0 && pixel_sigma < 100.0))
    throw OptionsError("noise.pixel_sigma must be 0 to 100 pixels");
  if (!(depth_sigma > 0.0 && depth_sigma < 10.0))
    throw OptionsError("noise.depth_sigma must be 0 to 10 metres");
  if (!(outlier_factor >= 1.0 && outlier_factor <= 100.0))
    throw OptionsError("noise.outlier_factor must be 1 to 100");
  if (!(depth_sigma_growth >= 0.0 && depth_sigma_growth < 10.0)) {
    throw OptionsError("noise.depth_sigma_growth must be 0 to 10 (1/metre)");
  }
}

MeasurementNoise MeasurementNoise::known_of(const std::optional<double>& pixels,
                                            const std::optional<DepthNoise>& depth) const {
  MeasurementNoise known = *this;
  if (pixels) known.pixel_sigma = *pixels;
  if (depth) {
    known.depth_sigma = depth->constant;
    known.depth_sigma_growth = depth->growth;
  }
  return known;
}

Measurement Measurement::make(const Eigen::Vector2f& pixel, float depth, float scale,
                              const MeasurementNoise& noise, double inverse_depth_sigma) {
  Measurement m;
  m.pixel = pixel.cast<double>();
  m.depth = depth;
  m.pixel_weight = 1.0 / (noise.pixel_sigma * scale);
  m.outlier_factor = noise.outlier_factor;
  if (depth > 0.0F)
    m.depth_weight = inverse_depth_sigma > 0.0 ? 1.0 / inverse_depth_sigma
                                               : m.depth * m.depth / noise.sigma_of_depth(m.depth);
  return m;
}

Eigen::Vector3d ReprojectionError::error(const Eigen::Vector3d& point_camera) const {
  const Eigen::Vector2d pixel = camera.project(point_camera) - measurement.pixel;
  const double inverse_depth =
      measurement.has_depth() ? 1.0 / measurement.depth - 1.0 / point_camera.z() : 0.0;
  return {measurement.pixel_weight * pixel.x(), measurement.pixel_weight * pixel.y(),
          measurement.depth_weight * inverse_depth};
}

Eigen::Matrix3d ReprojectionError::jacobian(const Eigen::Vector3d& p) const {
  const double inverse_z = 1.0 / p.z();
  const double x_scale = measurement.pixel_weight * camera.fx * inverse_z;
  const double y_scale = measurement.pixel_weight * camera.fy * inverse_z;
  Eigen::Matrix3d j;
  j << x_scale, 0.0, -x_scale * p.x() * inverse_z,  //
      0.0, y_scale, -y_scale * p.y() * inverse_z,   //
      0.0, 0.0, measurement.depth_weight * inverse_z * inverse_z;
  return j;
}

}  // namespace roslam
