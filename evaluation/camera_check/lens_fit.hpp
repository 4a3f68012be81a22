// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "evaluation/camera_check/contrast.hpp"
#include "evaluation/camera_check/tracked_pair.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam::evaluation {

/// How the distortion coefficients of a camera are read.
enum class LensReading {
  kAsGiven,  ///< coefficients distort (Brown-Conrady; Kannala and Brandt of a fisheye)
  kInverse,  ///< they undistort (inverse Brown-Conrady), which is about the opposite sign
  kNone,     ///< they are left out
};

/// How well pairs of images are explained by rigid motion under a reading of the lens.
struct LensFit {
  std::size_t pairs = 0;
  std::size_t points = 0;
  double error = 0.0;        ///< mean distance of points from where they should be, pixels, each at most 5
  double outer_error = 0.0;  ///< of the outer third of the image
  double free_error = 0.0;   ///< with the radial coefficient below
  Contrast k1 = {};          ///< radial coefficient that should be added to the reading
  Contrast focal = {};       ///< relative error of the focal length that goes with it
  Contrast corner = {};      ///< the same as a displacement of the image corner, pixels
  double outermost = 0.0;    ///< radius that 95 % of the points are within, as a share of that of the corner
  std::vector<SE3>
      T_to_from;  ///< motion of each pair, as estimated without k1; identity without enough points
  std::vector<bool> has_motion;  ///< whether it was estimated
};

/// Fits the motion of each pair (perspective-n-point with robust weights) and one radial coefficient for
/// all, x_distorted = (1 + d) x (1 + k1 r^2) after the reading, where d allows for an error of the focal
/// length. Depth is taken under the alignment. Standard deviations are by the scatter of the gradients of
/// the runs ("sandwich" estimate).
LensFit fit_lens(const Camera& camera, LensReading reading, const std::vector<TrackedPair>& pairs,
                 const Alignment& alignment, const std::stop_token& stop);

}  // namespace roslam::evaluation
