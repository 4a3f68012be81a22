// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>

#include "evaluation/camera_check/camera_check.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::evaluation {

/// What the images of stereo pairs say about their rectification.
struct StereoCheck {
  CameraFinding order;  ///< whether the left image is that of the left camera
  CameraFinding rows;   ///< whether points are on the same row of both images

  std::size_t pairs = 0;      ///< that were looked at
  std::size_t matches = 0;    ///< of ORB features, on one row but for a common error
  double to_the_left = 0.0;   ///< share of the matches with a disparity above one pixel
  double to_the_right = 0.0;  ///< share with one below minus one pixel
  double offset = 0.0;        ///< pixels, how much lower points are in the right image, median
  double worst = 0.0;         ///< pixels, the largest offset in a corner, by a linear fit over the image

  bool fits() const { return order.verdict != Verdict::kDoesNotFit && rows.verdict != Verdict::kDoesNotFit; }
};

/// Matches ORB features of rectified pairs regardless of rows. Reads a bounded number of frames. name: of the
/// source, for errors. Throws InputError if the source has no pairs or a stop was requested.
StereoCheck check_stereo(FrameSource& source, const std::string& name,
                         const std::function<void(std::size_t, std::size_t)>& progress,
                         const std::stop_token& stop);

}  // namespace roslam::evaluation
