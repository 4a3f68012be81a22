// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/orb_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr int kPatchRadius = 15;  // pixels of a level: the patch ORB describes is 31 wide
constexpr int kBorder = 19;       // pixels of a level without points, so that the rotated patch stays inside
constexpr int kFastRadius = 3;    // pixels of a level FAST looks around a corner

void require(bool condition, const char* message) {
  if (!condition) throw OptionsError(std::string("orb.") + message);
}

// Maps a pixel of a level to the full image. The sides of levels are rounded to whole pixels, up to 0.2 % off
// the nominal scale: about a pixel over the width of an image, which would bias forward motion.
class ToFullImage {
 public:
  ToFullImage(const cv::Size& full, const cv::Size& level)
      : x_(static_cast<float>(full.width) / static_cast<float>(level.width)),
        y_(static_cast<float>(full.height) / static_cast<float>(level.height)) {}

  // Integer coordinates are pixel centres, not corners.
  cv::Point2f operator()(const cv::Point2f& pixel) const {
    return {(pixel.x + 0.5F) * x_ - 0.5F, (pixel.y + 0.5F) * y_ - 0.5F};
  }

 private:
  float x_;
  float y_;
};

// Picks points round-robin from the cells of a grid, strongest first in each cell, until there are enough.
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint>& points, const cv::Size& size, int wanted) {
  if (static_cast<int>(points.size()) <= wanted) return points;
  const double side = std::sqrt(static_cast<double>(size.area()) / wanted);
  const int columns = std::max(1, static_cast<int>(std::ceil(size.width / side)));
  const auto cell_of = [&](const cv::KeyPoint& p) {
    return static_cast<int>(p.pt.y / side) * columns + static_cast<int>(p.pt.x / side);
  };
  for (auto& point : points) point.class_id = cell_of(point);
  std::sort(points.begin(), points.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    if (a.class_id != b.class_id) return a.class_id < b.class_id;
    if (a.response != b.response) return a.response > b.response;
    return a.pt.y != b.pt.y ? a.pt.y < b.pt.y : a.pt.x < b.pt.x;
  });
  // The round in which a point is picked is its rank within its cell.
  int rank = 0;
  for (std::size_t i = 0, previous_cell = points.size(); i < points.size(); ++i) {
    const auto cell = static_cast<std::size_t>(points[i].class_id);
    rank = i > 0 && cell == previous_cell ? rank + 1 : 0;
    previous_cell = cell;
    points[i].octave = rank;
  }
  std::nth_element(points.begin(), points.begin() + wanted, points.end(),
                   [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
                     if (a.octave != b.octave) return a.octave < b.octave;
                     if (a.response != b.response) return a.response > b.response;
                     return a.class_id < b.class_id;
                   });
  points.resize(static_cast<std::size_t>(wanted));
  return points;
}

// Direction from the centre of a round patch to its intensity centroid (Rublee et al. 2011, eq. 3), degrees.
float orientation(const cv::Mat& image, const cv::Point& centre, const std::vector<int>& circle) {
  int moment_x = 0;
  int moment_y = 0;
  const auto* row = image.ptr<uchar>(centre.y) + centre.x;
  for (int x = -kPatchRadius; x <= kPatchRadius; ++x) moment_x += x * row[x];
  for (int y = 1; y <= kPatchRadius; ++y) {
    const auto* below = image.ptr<uchar>(centre.y + y) + centre.x;
    const auto* above = image.ptr<uchar>(centre.y - y) + centre.x;
    const int half_width = circle[static_cast<std::size_t>(y)];
    int difference = 0;
    for (int x = -half_width; x <= half_width; ++x) {
      moment_x += x * (below[x] + above[x]);
      difference += below[x] - above[x];
    }
    moment_y += y * difference;
  }
  return cv::fastAtan2(static_cast<float>(moment_y), static_cast<float>(moment_x));
}
}  // namespace

void OrbOptions::validate() const {
  require(features >= 50 && features <= 20000, "features must be 50 to 20000");
  require(levels >= 1 && levels <= 16, "levels must be 1 to 16");
  require(scale_factor > 1.0 && scale_factor <= 2.0, "scale_factor must be above 1 and at most 2");
  require(fast_threshold >= 1 && fast_threshold <= 255, "fast_threshold must be 1 to 255");
  require(min_fast_threshold >= 1 && min_fast_threshold <= fast_threshold,
          "min_fast_threshold must be 1 to fast_threshold");
  require(cell_size >= 16, "cell_size must be at least 16 pixels");
  require(mask_margin >= 0 && mask_margin <= 100, "mask_margin must be 0 to 100 pixels");
}

OrbExtractor::OrbExtractor(const OrbOptions& options) : options_(options) {
  options_.validate();
  double total = 0.0;
  for (int level = 0; level < options_.levels; ++level) {
    scales_.push_back(static_cast<float>(std::pow(options_.scale_factor, level)));
    total += 1.0 / scales_.back();
  }
  for (const float scale : scales_) {
    quotas_.push_back(static_cast<int>(std::lround(options_.features / (total * scale))));
  }
  for (int y = 0; y <= kPatchRadius; ++y) {
    circle_.push_back(static_cast<int>(std::sqrt(kPatchRadius * kPatchRadius - y * y + 0.5)));
  }
  describer_ =
      cv::ORB::create(options_.features, static_cast<float>(options_.scale_factor), options_.levels, kBorder,
                      0, 2, cv::ORB::FAST_SCORE, 2 * kPatchRadius + 1, options_.fast_threshold);
}

std::vector<cv::KeyPoint> OrbExtractor::corners(const cv::Mat& level_image) const {
  std::vector<cv::KeyPoint> found;
  std::vector<cv::KeyPoint> in_cell;
  const int width = level_image.cols - 2 * kBorder;
  const int height = level_image.rows - 2 * kBorder;
  if (width < 1 || height < 1) return found;
  const int columns = std::max(1, width / options_.cell_size);
  const int rows = std::max(1, height / options_.cell_size);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const cv::Point begin(kBorder + width * c / columns - kFastRadius,
                            kBorder + height * r / rows - kFastRadius);
      const cv::Point end(kBorder + width * (c + 1) / columns + kFastRadius,
                          kBorder + height * (r + 1) / rows + kFastRadius);
      const cv::Mat cell = level_image(cv::Rect(begin, end));
      cv::FAST(cell, in_cell, options_.fast_threshold, true);
      if (in_cell.empty()) cv::FAST(cell, in_cell, options_.min_fast_threshold, true);
      for (auto& corner : in_cell) {
        corner.pt += cv::Point2f(begin);
        found.push_back(corner);
      }
    }
  }
  return found;
}

std::vector<cv::KeyPoint> OrbExtractor::detect(const std::vector<cv::Mat>& pyramid, const cv::Mat& mask,
                                               const cv::Mat& part, std::vector<cv::Point2f>* removed) const {
  std::vector<cv::KeyPoint> all;
  const auto share_of = [](const cv::Mat& set) {
    return set.empty() ? 0.0 : static_cast<double>(cv::countNonZero(set)) / static_cast<double>(set.total());
  };
  const double masked_share = share_of(mask);
  const double part_share = share_of(part);
  int surplus = 0;  // quota that finer levels could not fill, passed on to coarser ones
  for (std::size_t level = 0; level < pyramid.size(); ++level) {
    const cv::Size size = pyramid[level].size();
    const ToFullImage to_full_image(pyramid.front().size(), size);
    const auto is_clear_of = [&](const cv::Mat& set, const cv::KeyPoint& p) {
      const cv::Point2f pixel = to_full_image(p.pt);
      return set.at<uchar>(cvRound(pixel.y), cvRound(pixel.x)) == 0;
    };
    auto points = corners(pyramid[level]);
    if (!mask.empty()) {
      const auto masked = std::stable_partition(points.begin(), points.end(),
                                                [&](const cv::KeyPoint& p) { return is_clear_of(mask, p); });
      std::vector<cv::KeyPoint> rejected(masked, points.end());
      points.erase(masked, points.end());
      if (const int share = static_cast<int>(std::lround(part_share * quotas_[level])); share > 0) {
        auto usable = rejected;
        std::erase_if(usable, [&](const cv::KeyPoint& p) { return is_clear_of(part, p); });
        finish(spread(usable, size, share), pyramid[level], level, true, all);
      }
      const int share = static_cast<int>(std::lround(masked_share * quotas_[level]));
      if (removed != nullptr && share > 0) {
        for (const auto& p : spread(rejected, size, share)) removed->push_back(to_full_image(p.pt));
      }
    }
    const int wanted = quotas_[level] + surplus;
    points = spread(points, size, wanted);
    surplus = wanted - static_cast<int>(points.size());
    finish(std::move(points), pyramid[level], level, false, all);
  }
  return all;
}

// Adds points of a level, with their orientation.
void OrbExtractor::finish(std::vector<cv::KeyPoint> points, const cv::Mat& image, std::size_t level,
                          bool is_in_part, std::vector<cv::KeyPoint>& all) const {
  for (auto& point : points) {
    point.angle = orientation(image, point.pt, circle_);
    point.octave = static_cast<int>(level);
    point.class_id = is_in_part ? 1 : 0;
    all.push_back(point);
  }
}

cv::Mat OrbExtractor::forbidden(const cv::Mat& mask) const {
  const int side = 2 * options_.mask_margin + 1;
  cv::Mat wider;
  cv::dilate(mask, wider, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return wider;
}

std::vector<cv::Mat> OrbExtractor::pyramid(const cv::Mat& grey) const {
  if (grey.empty() || grey.type() != CV_8UC1) throw InputError("ORB extraction needs an 8-bit grey image");
  std::vector<cv::Mat> pyramid{grey};
  for (std::size_t level = 1; level < scales_.size(); ++level) {
    const cv::Size size(cvRound(static_cast<float>(grey.cols) / scales_[level]),
                        cvRound(static_cast<float>(grey.rows) / scales_[level]));
    cv::Mat smaller;
    cv::resize(pyramid.back(), smaller, size, 0, 0, cv::INTER_LINEAR);
    pyramid.push_back(smaller);
  }
  return pyramid;
}

std::vector<OrbFeature> OrbExtractor::extract(const std::vector<cv::Mat>& pyramid, const cv::Mat& mask,
                                              const cv::Mat& part, std::vector<cv::Point2f>* removed) const {
  const cv::Mat& grey = pyramid.front();
  if (!mask.empty() && (mask.size() != grey.size() || mask.type() != CV_8UC1)) {
    throw InputError("the mask of ORB extraction must be an 8-bit image of the size of the image");
  }
  std::vector<cv::KeyPoint> points = detect(pyramid, mask.empty() ? mask : forbidden(mask), part, removed);
  std::vector<OrbFeature> features(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto level = static_cast<std::size_t>(points[i].octave);
    features[i].pixel = ToFullImage(grey.size(), pyramid[level].size())(points[i].pt);
    points[i].pt *= scales_[level];  // OpenCV divides by the nominal scale to find the pixel of the level
  }
  cv::Mat descriptors;
  if (!points.empty()) describer_->compute(grey, points, descriptors);
  for (std::size_t i = 0; i < points.size(); ++i) {
    features[i].level = points[i].octave;
    features[i].is_in_part = points[i].class_id == 1;
    features[i].angle = points[i].angle;
    std::memcpy(features[i].descriptor.data(), descriptors.ptr(static_cast<int>(i)), sizeof(Descriptor));
  }
  return features;
}

}  // namespace roslam
