// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/se3.hpp"
#include "simulation/composition/composed_walk.hpp"
#include "simulation/composition/person_cutout.hpp"

namespace roslam::simulation {

/// A rendering of one person without the scene; all images as large as the camera's.
struct PersonLayer {
  cv::Mat colour;  ///< CV_32FC3, BGR times alpha
  cv::Mat alpha;   ///< CV_32FC1, share of the pixel that the person covers, 0 to 1
  cv::Mat depth;   ///< CV_32FC1, metres along the optical axis where alpha > 0.5, else 0
};

/// How a cutout is rendered.
struct PersonShape {
  double height = 1.75;     ///< metres
  double thickness = 0.14;  ///< depth from the outline to the point nearest to the camera, metres
  double gain = 1.0;        ///< brightness
  bool mirrored = false;
};

/// A life-size upright billboard: an image that always faces the camera, with a depth profile rounded
/// towards its outline.
class ComposedPerson {
 public:
  ComposedPerson(const PersonCutout& cutout, const PersonShape& shape);

  /// The person with their feet at a point of the world frame. up: unit vector, world frame. Images are
  /// empty if the camera is above or inside the person.
  PersonLayer seen_from(const SE3& T_world_camera, const PixelRays& rays, const Eigen::Vector3d& feet,
                        const Eigen::Vector3d& up) const;

  double height() const { return shape_.height; }
  double width() const;

 private:
  std::size_t level_for(double distance, double fy) const;

  PersonShape shape_;
  std::vector<cv::Mat> levels_;  // image pyramid, CV_32FC4: BGR times alpha, and alpha
  cv::Mat relief_;               // CV_32FC1, metres in front of the outline
};

}  // namespace roslam::simulation
