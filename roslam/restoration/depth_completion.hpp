// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

struct DepthCompletionOptions {
  int cell = 8;   ///< pixels, side of the cells in which depth is looked at
  int guard = 4;  ///< pixels along a hole whose depth is not believed: what was removed may reach there
  double plane_tolerance = 0.03;  ///< share of the depth by which a cell of a plane may be off
  int max_planes = 6;             ///< looked for around a hole
  double min_votes =
      0.2;  ///< share of the directions from a pixel in which a surface must be met to reach it

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// The depth of what was invented, from what is around it. Around each hole planes are fitted, to the inverse
/// of the depth, which is linear in the picture where a surface is flat. A pixel looks along sixteen
/// directions for the surfaces around the hole; of those met in enough of them, continued to the pixel, the
/// nearest hides the others. What has no depth around, such as the sky, has none in the hole either. depth:
/// CV_32FC1 metres, 0 = unknown, also in the hole. hole: CV_8UC1, nonzero where depth is wanted. Returns
/// CV_32FC1, 0 where nothing can be said or outside of the hole.
cv::Mat completed_depth(const cv::Mat& depth, const cv::Mat& hole,
                        const DepthCompletionOptions& options = {});

}  // namespace roslam
