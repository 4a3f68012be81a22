// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "evaluation/plots/plot.hpp"

namespace roslam::evaluation {

namespace {
// Red, green, blue. The order of Okabe and Ito's palette is changed so that the first two differ most; black
// and grey are left to the truth.
constexpr std::array<std::array<int, 3>, 8> kLineColours{{{0, 114, 178},
                                                          {213, 94, 0},
                                                          {0, 158, 115},
                                                          {204, 121, 167},
                                                          {230, 159, 0},
                                                          {86, 180, 233},
                                                          {120, 80, 40},
                                                          {150, 60, 200}}};
}  // namespace

std::vector<double> nice_ticks(const Range& range, int max_count) {
  // Allows a tick that rounding pushed just outside the range.
  constexpr double kSlack = 1e-9;
  double power = std::pow(10.0, std::floor(std::log10(range.span())) - 2.0);
  for (;; power *= 10.0) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double step = digit * power;
      const double first = std::ceil(range.min / step - kSlack);
      const double last = std::floor(range.max / step + kSlack);
      if (last - first + 1.0 > std::max(1, max_count)) continue;
      std::vector<double> ticks;
      const int count = static_cast<int>(last - first) + 1;
      for (int i = 0; i < count; ++i) {
        const double multiple = first + i;
        ticks.push_back(multiple == 0.0 ? 0.0 : multiple * step);  // 0.0: never minus zero
      }
      return ticks;
    }
  }
}

std::vector<std::string> tick_labels(const std::vector<double>& ticks) {
  constexpr int kMostDecimals = 9;
  double step = ticks.size() > 1 ? ticks[1] - ticks[0] : std::abs(ticks.empty() ? 1.0 : ticks[0]);
  if (!(step > 0.0)) step = 1.0;
  const double largest = ticks.empty() ? 0.0 : std::max(std::abs(ticks.front()), std::abs(ticks.back()));
  const bool scientific = step < 1e-4 || largest >= 1e6;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, kMostDecimals);
  std::vector<std::string> labels;
  for (const double tick : ticks) {
    std::array<char, 64> text{};
    if (scientific && tick != 0.0) {
      std::snprintf(text.data(), text.size(), "%.3g", tick);
    } else {
      std::snprintf(text.data(), text.size(), "%.*f", tick == 0.0 ? 0 : decimals, tick);
    }
    labels.emplace_back(text.data());
  }
  return labels;
}

Colour scale_colour(double share) {
  const auto level = static_cast<unsigned char>(std::lround(255.0 * std::clamp(share, 0.0, 1.0)));
  const cv::Mat grey(1, 1, CV_8UC1, cv::Scalar(level));
  cv::Mat colour;
  cv::applyColorMap(grey, colour, cv::COLORMAP_TURBO);
  const auto& bgr = colour.at<cv::Vec3b>(0, 0);
  return {static_cast<double>(bgr[0]), static_cast<double>(bgr[1]), static_cast<double>(bgr[2])};
}

Colour line_colour(std::size_t index) {
  const auto& rgb = kLineColours[index % kLineColours.size()];
  return {static_cast<double>(rgb[2]), static_cast<double>(rgb[1]), static_cast<double>(rgb[0])};
}

LineStyle line_style(std::size_t index) {
  return {line_colour(index), 1.8, index / kLineColours.size() % 2 == 1};
}

}  // namespace roslam::evaluation
