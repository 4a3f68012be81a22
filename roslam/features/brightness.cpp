// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/brightness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace roslam {

namespace {
constexpr int kValues = 256;

struct Range {
  int low = 0;
  int high = 0;
};

// Grey values of the percentiles 1 and 99.
Range range_in_use(const cv::Mat& grey) {
  constexpr int kStep = 4;  // every fourth pixel of every fourth row
  std::array<int, kValues> histogram{};
  int total = 0;
  for (int y = 0; y < grey.rows; y += kStep) {
    const auto* row = grey.ptr<std::uint8_t>(y);
    for (int x = 0; x < grey.cols; x += kStep, ++total) ++histogram[row[x]];
  }
  const auto percentile = [&](double share) {
    int count = 0;
    for (int value = 0; value < kValues; ++value) {
      count += histogram[static_cast<std::size_t>(value)];
      if (count > share * total) return value;
    }
    return kValues - 1;
  };
  return {percentile(0.01), percentile(0.99)};
}
}  // namespace

void BrightnessNormaliser::update(const cv::Mat& grey) {
  constexpr double kEnough = 64.0;    // grey values that an image uses without need of a stretch
  constexpr double kMostGain = 16.0;  // beyond it noise and quantisation are all there is
  constexpr double kHold = 1.25;      // change of the gain from which a new one is taken
  constexpr int kDark = 64;
  const Range range = range_in_use(grey);
  ++frames_;
  // An image of one colour has nothing to stretch.
  const int used = range.high - range.low;
  const double gain = used == 0 ? 1.0 : std::clamp(kEnough / used, 1.0, kMostGain);
  if (gain > 1.0) ++(range.high < kDark ? dark_ : flat_);
  const bool fits =
      gain < gain_ * kHold && gain > gain_ / kHold && std::abs(range.low - offset_) < kEnough / 4;
  if (gain_ > 1.0 && gain > 1.0 && fits) return;
  gain_ = gain;
  offset_ = range.low;
  if (gain == 1.0) {
    table_.release();
    return;
  }
  table_.create(1, kValues, CV_8UC1);
  for (int value = 0; value < kValues; ++value)
    table_.at<std::uint8_t>(value) = cv::saturate_cast<std::uint8_t>(offset_ + gain_ * (value - offset_));
}

cv::Mat BrightnessNormaliser::apply(const cv::Mat& image) const {
  if (!is_on()) return image;
  cv::Mat stretched;
  cv::LUT(image, table_, stretched);
  return stretched;
}

std::map<std::string, std::size_t> BrightnessNormaliser::warnings() const {
  constexpr std::size_t kSeveral = 10;  // frames
  constexpr std::size_t kShare = 5;     // every fifth of all
  const auto are_many = [&](std::size_t frames) { return frames >= kSeveral && kShare * frames >= frames_; };
  std::map<std::string, std::size_t> warnings;
  if (are_many(dark_)) warnings["the images are dark; expose longer or add light"] = dark_;
  if (are_many(flat_)) warnings["the images have little contrast; check the lens and the exposure"] = flat_;
  return warnings;
}

}  // namespace roslam
