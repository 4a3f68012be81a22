// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/restoration/inpainter.hpp"
#include "roslam/restoration/removed_region.hpp"
#include "roslam/restoration/restoration_options.hpp"

namespace roslam {

/// Inpaints pixels that no source image shows: a crop around each hole with the inpainter, seam-blended into
/// the image; without an inpainter (null), and for small holes, by InpaintingOptions::classic. image: CV_8UC3
/// (BGR), content in the hole ignored. hole: CV_8UC1, nonzero where to inpaint. regions: give the class of
/// the removed object. An image that is all hole becomes grey. Returns the filled image. Throws ModelError.
cv::Mat inpaint_hole(const cv::Mat& image, const cv::Mat& hole, const std::vector<RemovedRegion>& regions,
                     Inpainter* inpainter, const InpaintingOptions& options = {});

}  // namespace roslam
