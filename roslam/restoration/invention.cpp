// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/invention.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <string>

#include "roslam/error.hpp"
#include "roslam/restoration/seam.hpp"

namespace roslam {

void InventionOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("invention.") + message);
  };
  require(max_crops >= 0 && max_crops <= 64, "max_crops must be 0 to 64");
  require(min_width >= 1 && min_width <= 256, "min_width must be 1 to 256 pixels");
  require(joined_within >= 1 && joined_within <= 256, "joined_within must be 1 to 256 pixels");
  require(context >= 1.0 && context <= 10.0, "context must be 1 to 10");
  require(min_crop >= 16 && min_crop <= 4096, "min_crop must be 16 to 4096 pixels");
}

namespace {
constexpr double kClassicRadius = 5;  // pixels that a classic method looks at

cv::Mat ellipse(int side) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}); }

cv::Rect grown(const cv::Rect& box, int by) {
  return {box.x - by, box.y - by, box.width + 2 * by, box.height + 2 * by};
}

// A part of the hole that is painted at once.
struct Part {
  cv::Rect box;
  cv::Mat hole;  // CV_8UC1 of the picture's size
};

// The largest parts of the hole that lie apart.
std::vector<Part> parts_of(const cv::Mat& hole, const InventionOptions& options) {
  cv::Mat wide, joined, labels, stats, centroids;
  cv::morphologyEx(hole, wide, cv::MORPH_OPEN, ellipse(options.min_width));
  cv::dilate(wide, joined, ellipse(options.joined_within + 1));
  std::vector<int> numbers(
      static_cast<std::size_t>(cv::connectedComponentsWithStats(joined, labels, stats, centroids)));
  std::iota(numbers.begin(), numbers.end(), 0);
  numbers.erase(numbers.begin());  // what lies around
  std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
    return stats.at<int>(a, cv::CC_STAT_AREA) > stats.at<int>(b, cv::CC_STAT_AREA);
  });
  numbers.resize(std::min(numbers.size(), static_cast<std::size_t>(options.max_crops)));
  std::vector<Part> parts;
  for (const int number : numbers) {
    const cv::Mat part = (labels == number) & hole;
    parts.push_back({cv::boundingRect(part), part});
  }
  return parts;
}

// Of the picture, around the box, square where the picture is large enough.
cv::Rect crop_around(const cv::Rect& box, const cv::Size& picture, const InventionOptions& options) {
  const int longer = std::max(box.width, box.height);
  const int side = std::max(options.min_crop, static_cast<int>(std::lround(options.context * longer)));
  const cv::Size size(std::min(side, picture.width), std::min(side, picture.height));
  return {std::clamp(box.x + (box.width - size.width) / 2, 0, picture.width - size.width),
          std::clamp(box.y + (box.height - size.height) / 2, 0, picture.height - size.height), size.width,
          size.height};
}

// hole: all that is not known yet, of which the part is painted.
void paint_part(cv::Mat& picture, const cv::Mat& hole, const Part& part, Movable kind, Inpainter& inpainter,
                const InventionOptions& options) {
  const cv::Rect crop = crop_around(part.box, picture.size(), options);
  const cv::Size size(kCropSide, kCropSide);
  cv::Mat small, small_hole;
  const int interpolation = crop.width > kCropSide ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(picture(crop), small, size, 0, 0, interpolation);
  cv::resize(hole(crop), small_hole, size, 0, 0, interpolation);  // what mixes known and unknown is unknown
  small_hole = small_hole > 0;
  const cv::Rect square = square_around(cv::boundingRect(small_hole));
  cv::Mat paint;
  cv::resize(inpainter.paint(small, small_hole, square, kind), paint, crop.size(), 0, 0, cv::INTER_CUBIC);

  const cv::Mat in_crop = hole(crop);
  cv::Mat rim;
  cv::dilate(in_crop, rim, ellipse(2 * kSeamRim + 1));
  matched_to_rim(picture(crop), paint, rim, in_crop).copyTo(picture(crop), part.hole(crop));
}

void fill_classically(cv::Mat& picture, const cv::Mat& hole, ClassicMethod method) {
  const cv::Rect image({0, 0}, picture.size());
  const cv::Rect box = grown(cv::boundingRect(hole), 2 * static_cast<int>(kClassicRadius)) & image;
  cv::Mat filled;
  cv::inpaint(picture(box), hole(box), filled, kClassicRadius,
              method == ClassicMethod::kTelea ? cv::INPAINT_TELEA : cv::INPAINT_NS);
  filled.copyTo(picture(box), hole(box));
}
}  // namespace

cv::Mat invent(const cv::Mat& picture, const cv::Mat& hole, const std::vector<RemovedRegion>& regions,
               Inpainter* inpainter, const InventionOptions& options) {
  CV_Assert(picture.type() == CV_8UC3 && hole.type() == CV_8UC1 && hole.size() == picture.size());
  cv::Mat result = picture.clone();
  cv::Mat left = hole != 0;
  if (cv::countNonZero(left) == static_cast<int>(left.total()))
    return cv::Mat(picture.size(), CV_8UC3, cv::Scalar(128, 128, 128));
  result.setTo(cv::Scalar(128, 128, 128), left);
  if (inpainter) {
    for (const Part& part : parts_of(left, options)) {
      paint_part(result, left, part, kind_of(part.box, regions), *inpainter, options);
      left.setTo(0, part.hole);
    }
  }
  if (cv::countNonZero(left) > 0) fill_classically(result, left, options.classic);
  return result;
}

}  // namespace roslam
