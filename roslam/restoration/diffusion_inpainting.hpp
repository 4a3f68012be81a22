// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/restoration/restoration_options.hpp"

namespace roslam {

/// False in a library without the component semantics, which opencv_photo belongs to: holes then stay open.
bool has_diffusion_inpainting();

/// Fills the hole (CV_8UC1, nonzero) of an image (CV_8UC3, BGR) from its rim (cv::inpaint).
void inpaint_by_diffusion(cv::Mat& image, const cv::Mat& hole, ClassicMethod method);

}  // namespace roslam
