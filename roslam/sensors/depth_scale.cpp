// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr std::size_t kFewestImages = 8;
constexpr std::size_t kMostValues = 4000;  // of a band, and of baselines

// Bands of depth: band i begins at kNearest * kGrowth^i and is narrow, so that its steps are equal.
constexpr double kNearest = 0.4;  // metres
constexpr double kGrowth = 1.15;
constexpr double kWidth = 1.04;  // ratio of its end to its beginning

double begin_of(std::size_t band) { return kNearest * std::pow(kGrowth, static_cast<double>(band)); }
}  // namespace

void DepthScale::add(const cv::Mat& depth, double fx) {
  constexpr int kRowStep = 8;
  constexpr std::size_t kEnough = 60;  // images
  if (images_ >= kEnough) return;
  ++images_;
  fx_ = fx;
  for (int y = kRowStep / 2; y < depth.rows; y += kRowStep) add_row(depth.ptr<float>(y), depth.cols);
}

void DepthScale::add_row(const float* row, int size) {
  constexpr int kNarrowest = 3;  // pixels of a shadow
  constexpr int kWidest = 80;
  constexpr float kStep = 1.25F;  // ratio of depths beside it
  int last = -1;
  for (int x = 0; x < size; ++x) {
    const float z = row[x];
    if (!(z > 0.0F) || !std::isfinite(z)) continue;
    const double position = std::log(z / kNearest) / std::log(kGrowth);
    const auto band = static_cast<std::size_t>(std::max(position, 0.0));
    if (position >= 0.0 && band < kBands && z < kWidth * begin_of(band) && depths_[band].size() < kMostValues)
      depths_[band].push_back(z);
    const int gap = x - last - 1;
    if (last >= 0 && gap >= kNarrowest && gap <= kWidest &&
        std::max(z, row[last]) > kStep * std::min(z, row[last])) {
      auto& found = baselines_[z < row[last] ? 0 : 1];
      if (found.size() < kMostValues)
        found.push_back(static_cast<float>(gap / (fx_ * std::abs(1.0 / z - 1.0 / row[last]))));
    }
    last = x;
  }
}

std::optional<double> DepthScale::step_factor() const {
  constexpr std::size_t kFewestSteps = 4;   // in a band
  constexpr std::size_t kValuesAStep = 20;  // so that every step is seen
  constexpr std::size_t kFewestBands = 3;
  constexpr double kResolved = 2.5;  // units of depth; smaller steps are rounded
  constexpr double kSpread = 0.1;
  struct Steps {
    double z;
    double size;
  };
  std::vector<Steps> all;
  double unit = std::numeric_limits<double>::max();
  for (std::size_t band = 0; band < kBands; ++band) {
    std::vector<float> values = depths_[band];
    const std::size_t count = values.size();
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    for (std::size_t i = 1; i < values.size(); ++i)
      unit = std::min(unit, static_cast<double>(values[i] - values[i - 1]));
    if (values.size() < kFewestSteps || count < kValuesAStep * values.size()) continue;
    all.push_back({0.5 * (values.front() + values.back()),
                   (values.back() - values.front()) / static_cast<double>(values.size() - 1)});
  }
  std::vector<double> factors;
  double nearest = std::numeric_limits<double>::max();
  double farthest = 0.0;
  for (const Steps& steps : all) {
    if (steps.size < kResolved * unit) continue;
    factors.push_back(steps.size / (steps.z * steps.z));
    nearest = std::min(nearest, steps.z);
    farthest = std::max(farthest, steps.z);
  }
  if (factors.size() < kFewestBands || farthest < 1.4 * nearest) return std::nullopt;
  const double factor = upper_median(factors);
  const auto agree = std::count_if(factors.begin(), factors.end(),
                                   [&](double f) { return std::abs(f - factor) < kSpread * factor; });
  if (5 * agree < 4 * static_cast<std::ptrdiff_t>(factors.size())) return std::nullopt;
  return factor * fx_;
}

std::optional<double> DepthScale::baseline() const {
  constexpr std::size_t kFewest = 50;
  double largest = 0.0;  // the shadow is on one side; on the other are other holes
  for (std::vector<float> values : baselines_) {
    if (values.size() >= kFewest) largest = std::max(largest, static_cast<double>(upper_median(values)));
  }
  return largest > 0.0 ? std::make_optional(largest) : std::nullopt;
}

std::optional<double> DepthScale::implausible_baseline() const {
  if (images_ < kFewestImages) return std::nullopt;
  // Baseline (metres) over k * fx: 0.02 to 0.04 of a Kinect, 0.07 of a D435, 0.3 of a D455, 0.3 of stereo of
  // 0.11 m in steps of 1/16 pixel.
  constexpr double kImplausible = 0.55;
  constexpr double kShortest = 0.16;  // metres; shorter ones are plausible in themselves
  const auto width = baseline();
  if (!width || *width <= kShortest) return std::nullopt;  // as with most sensors; the steps cost more
  const auto factor = step_factor();
  return factor && *width > kImplausible * *factor ? width : std::nullopt;
}

}  // namespace roslam
