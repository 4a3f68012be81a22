// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/sources/composed_walk.hpp"
#include "roslam/sources/person_cutout.hpp"

namespace roslam {

/// One person as a camera would see them if nothing else were there; all images as large as the camera's.
struct PersonLayer {
  cv::Mat colour;  ///< CV_32FC3, BGR times alpha
  cv::Mat alpha;   ///< CV_32FC1, 0 to 1: how much of the pixel the person covers
  cv::Mat depth;   ///< CV_32FC1, metres along the optical axis where alpha > 0.5, else 0
};

/// How a picture becomes a person.
struct PersonShape {
  double height = 1.75;     ///< metres
  double thickness = 0.14;  ///< from the outline to what is nearest to the camera, metres
  double gain = 1.0;        ///< brightness
  bool mirrored = false;
};

/// A life-size upright picture that always faces the camera, with a depth profile rounded towards its
/// outline.
class ComposedPerson {
 public:
  ComposedPerson(const PersonCutout& cutout, const PersonShape& shape);

  /// The person with their feet at a point of the world. up: of the world, unit length. Images are empty
  /// where the camera stands above or inside the person.
  PersonLayer seen_from(const SE3& T_world_camera, const PixelRays& rays, const Eigen::Vector3d& feet,
                        const Eigen::Vector3d& up) const;

  double height() const { return shape_.height; }
  double width() const;

 private:
  std::size_t level_for(double distance, double fy) const;

  PersonShape shape_;
  std::vector<cv::Mat> levels_;  // CV_32FC4, BGR times alpha and alpha; each half the size of the one before
  cv::Mat relief_;               // CV_32FC1, metres in front of the outline
};

}  // namespace roslam
