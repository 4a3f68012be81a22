// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/diffusion_inpainting.hpp"

#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>

#include "roslam/common/widened.hpp"

namespace roslam {

bool has_diffusion_inpainting() { return true; }

void inpaint_by_diffusion(cv::Mat& image, const cv::Mat& hole, ClassicMethod method) {
  constexpr double kRadius = 5;  // pixels around each pixel that are considered
  constexpr int kRim = 2 * static_cast<int>(kRadius);
  const cv::Rect box = widened(cv::boundingRect(hole), kRim) & cv::Rect({0, 0}, image.size());
  cv::Mat filled;
  cv::inpaint(image(box), hole(box), filled, kRadius,
              method == ClassicMethod::kTelea ? cv::INPAINT_TELEA : cv::INPAINT_NS);
  filled.copyTo(image(box), hole(box));
}

}  // namespace roslam
