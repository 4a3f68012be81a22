// SPDX-License-Identifier: BSD-3-Clause
// In place of diffusion_inpainting.cpp in a library without OpenCV's module photo.
#include "roslam/restoration/diffusion_inpainting.hpp"

namespace roslam {

bool has_diffusion_inpainting() { return false; }

void inpaint_by_diffusion(cv::Mat&, const cv::Mat&, ClassicMethod) {}

}  // namespace roslam
