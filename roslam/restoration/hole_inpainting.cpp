// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/hole_inpainting.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/widened.hpp"
#include "roslam/restoration/diffusion_inpainting.hpp"
#include "roslam/restoration/disc_dilation.hpp"
#include "roslam/restoration/seam_blending.hpp"

namespace roslam {

void InpaintingOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("inpainting.") + message);
  };
  require(max_crops >= 0 && max_crops <= 64, "max_crops must be 0 to 64");
  require(min_width >= 1 && min_width <= 256, "min_width must be 1 to 256 pixels");
  require(joined_within >= 1 && joined_within <= 256, "joined_within must be 1 to 256 pixels");
  require(context >= 1.0 && context <= 10.0, "context must be 1 to 10");
  require(min_crop >= 16 && min_crop <= 4096, "min_crop must be 16 to 4096 pixels");
}

namespace {
cv::Mat ellipse(int side) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}); }

// A part of the hole that is inpainted in one crop.
struct Part {
  cv::Rect box;
  cv::Mat hole;  // CV_8UC1 of the image's size
};

// The largest separate parts of the hole, at most max_crops.
std::vector<Part> parts_of(const cv::Mat& hole, const InpaintingOptions& options) {
  const int reach = options.min_width + options.joined_within + 1;
  const cv::Rect box = cv::boundingRect(hole);
  const cv::Rect around = widened(box, reach) & cv::Rect({0, 0}, hole.size());
  const cv::Mat near = hole(around);
  cv::Mat wide, joined, labels, stats, centroids;
  cv::morphologyEx(near, wide, cv::MORPH_OPEN, ellipse(options.min_width));
  cv::dilate(wide, joined, ellipse(options.joined_within + 1));
  std::vector<int> numbers(
      static_cast<std::size_t>(cv::connectedComponentsWithStats(joined, labels, stats, centroids)));
  std::iota(numbers.begin(), numbers.end(), 0);
  numbers.erase(numbers.begin());  // background
  std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
    return stats.at<int>(a, cv::CC_STAT_AREA) > stats.at<int>(b, cv::CC_STAT_AREA);
  });
  numbers.resize(std::min(numbers.size(), static_cast<std::size_t>(options.max_crops)));
  std::vector<Part> parts;
  for (const int number : numbers) {
    cv::Mat part = cv::Mat::zeros(hole.size(), CV_8UC1);
    near.copyTo(part(around), labels == number);
    parts.push_back({cv::boundingRect(part), part});
  }
  return parts;
}

// A crop of the image around the box, square where the image is large enough.
cv::Rect crop_around(const cv::Rect& box, const cv::Size& image, const InpaintingOptions& options) {
  const int longer = std::max(box.width, box.height);
  const int side = std::max(options.min_crop, static_cast<int>(std::lround(options.context * longer)));
  const cv::Size size(std::min(side, image.width), std::min(side, image.height));
  return {std::clamp(box.x + (box.width - size.width) / 2, 0, image.width - size.width),
          std::clamp(box.y + (box.height - size.height) / 2, 0, image.height - size.height), size.width,
          size.height};
}

// hole: all pixels still unknown, of which the part is inpainted.
void inpaint_part(cv::Mat& image, const cv::Mat& hole, const Part& part, Movable kind, Inpainter& inpainter,
                  const InpaintingOptions& options) {
  const cv::Rect crop = crop_around(part.box, image.size(), options);
  const cv::Size size(kCropSide, kCropSide);
  cv::Mat small, small_hole;
  const int interpolation = crop.width > kCropSide ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(image(crop), small, size, 0, 0, interpolation);
  cv::resize(hole(crop), small_hole, size, 0, 0, interpolation);  // partly unknown: unknown
  small_hole = small_hole > 0;
  const cv::Rect square = square_around(cv::boundingRect(small_hole));
  cv::Mat generated;
  cv::resize(inpainter.inpaint(small, small_hole, square, kind), generated, crop.size(), 0, 0,
             cv::INTER_CUBIC);

  const cv::Mat in_crop = hole(crop);
  const cv::Mat rim = dilated_by_disc(in_crop, 2 * kSeamRim + 1);
  matched_to_rim(image(crop), generated, rim, in_crop).copyTo(image(crop), part.hole(crop));
}
}  // namespace

cv::Mat inpaint_hole(const cv::Mat& image, const cv::Mat& hole, const std::vector<RemovedRegion>& regions,
                     Inpainter* inpainter, const InpaintingOptions& options) {
  CV_Assert(image.type() == CV_8UC3 && hole.type() == CV_8UC1 && hole.size() == image.size());
  cv::Mat result = image.clone();
  cv::Mat unknown = hole != 0;
  if (cv::countNonZero(unknown) == static_cast<int>(unknown.total()))
    return cv::Mat(image.size(), CV_8UC3, cv::Scalar(128, 128, 128));
  result.setTo(cv::Scalar(128, 128, 128), unknown);
  if (inpainter) {
    for (const Part& part : parts_of(unknown, options)) {
      inpaint_part(result, unknown, part, kind_of(part.box, regions), *inpainter, options);
      unknown.setTo(0, part.hole);
    }
  }
  if (cv::countNonZero(unknown) > 0) inpaint_by_diffusion(result, unknown, options.classic);
  return result;
}

}  // namespace roslam
