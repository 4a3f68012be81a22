// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plots/bar_chart.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "evaluation/plots/canvas.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/plots/plot.hpp"
#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
// Sizes in pixels; of text the height of a capital letter.
constexpr double kTitleSize = 12.0;
constexpr double kTextSize = 9.0;
constexpr double kValueSize = 7.5;
constexpr double kMargin = 16.0;
constexpr double kAxisRoom = 76.0;  // left of the diagram
constexpr double kRow = 22.0;
constexpr double kDiagramHeight = 330.0;
constexpr double kBarWidth = 24.0;
constexpr double kBarGap = 3.0;
constexpr double kGroupGap = 34.0;
constexpr double kLeastWidth = 620.0;
constexpr double kSample = 14.0;  // side of a colour in the legend
constexpr double kLegendGap = 18.0;

bool has_bar(double value) { return std::isfinite(value) && value > 0.0; }

// From a step of 1, 2, 5, 10 below the least value to room for the label above the largest.
Range scale_of(const BarChart& chart) {
  double least = INFINITY;
  double largest = 0.0;
  for (const auto& group : chart.groups) {
    for (const double value : group.values) {
      if (!has_bar(value)) continue;
      least = std::min(least, value);
      largest = std::max(largest, value);
    }
  }
  if (largest == 0.0) return {0.1, 1.0};
  const double decade = std::pow(10.0, std::floor(std::log10(0.8 * least)));
  double low = decade;
  for (const double step : {2.0, 5.0}) {
    if (step * decade < 0.8 * least) low = step * decade;
  }
  constexpr double kRoomForFigures = 0.18;  // of the height
  const double high = largest * std::pow(largest / low, kRoomForFigures / (1.0 - kRoomForFigures));
  return {low, high};
}

std::vector<double> ticks_of(const Range& scale) {
  std::vector<double> ticks;
  for (double decade = std::pow(10.0, std::floor(std::log10(scale.min))); decade <= scale.max;
       decade *= 10.0) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const double tick = step * decade;
      if (tick >= 0.999 * scale.min && tick <= scale.max) ticks.push_back(tick);
    }
  }
  return ticks;
}

std::string plain(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

struct LegendEntry {
  cv::Point2d at;
  std::size_t series;
};

struct Layout {
  double group_width = 0.0;
  double width = 0.0;
  double height = 0.0;
  cv::Rect2d diagram;
  Range scale;
  std::vector<LegendEntry> legend;

  double y_of(double value) const {
    const double share = std::log(value / scale.min) / std::log(scale.max / scale.min);
    return diagram.y + diagram.height * (1.0 - std::clamp(share, 0.0, 1.0));
  }
};

Layout lay_out(const BarChart& chart) {
  Layout layout;
  layout.scale = scale_of(chart);
  layout.group_width = static_cast<double>(chart.series.size()) * (kBarWidth + kBarGap) - kBarGap;
  for (const auto& group : chart.groups) {
    layout.group_width = std::max(layout.group_width, Canvas::text_width(group.name, kTextSize));
  }
  const double bars = static_cast<double>(chart.groups.size()) * (layout.group_width + kGroupGap);
  layout.width = std::max(kLeastWidth, kAxisRoom + bars + kMargin);
  cv::Point2d at(kAxisRoom, kMargin + kTitleSize + kRow);
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const double length = kSample + 6.0 + Canvas::text_width(chart.series[i], kTextSize);
    if (at.x > kAxisRoom && at.x + length > layout.width - kMargin) at = {kAxisRoom, at.y + kRow};
    layout.legend.push_back({at, i});
    at.x += length + kLegendGap;
  }
  layout.diagram = {kAxisRoom, at.y + kRow, layout.width - kAxisRoom - kMargin, kDiagramHeight};
  layout.height = layout.diagram.y + kDiagramHeight + 2.0 * kRow;
  return layout;
}

void draw_axis(Canvas& canvas, const BarChart& chart, const Layout& layout) {
  const cv::Rect2d& box = layout.diagram;
  for (const double tick : ticks_of(layout.scale)) {
    const double y = layout.y_of(tick);
    canvas.line({{box.x, y}, {box.x + box.width, y}}, {{220, 220, 220}, 1.0});
    canvas.text(plain(tick), {box.x - 8.0, y}, kTextSize, Anchor::kRight);
  }
  canvas.text_upwards(chart.value_label, {kMargin + 4.0, box.y + 0.5 * box.height}, kTextSize);
}

void draw_group(Canvas& canvas, const BarChart& chart, const BarGroup& group, double left,
                const Layout& layout) {
  const double bottom = layout.diagram.y + layout.diagram.height;
  const double bars = static_cast<double>(chart.series.size()) * (kBarWidth + kBarGap) - kBarGap;
  double x = left + 0.5 * (layout.group_width - bars);
  for (std::size_t i = 0; i < group.values.size(); ++i, x += kBarWidth + kBarGap) {
    const double value = group.values[i];
    const double middle = x + 0.5 * kBarWidth;
    if (!has_bar(value)) {
      canvas.text("-", {middle, bottom - kTextSize}, kTextSize, Anchor::kCentre);
      continue;
    }
    const double top = layout.y_of(value);
    canvas.rectangle({x, top, kBarWidth, bottom - top}, line_colour(i));
    const std::string words = fixed(value, chart.decimals);
    canvas.text_upwards(words, {middle, top - 5.0 - 0.5 * Canvas::text_width(words, kValueSize)}, kValueSize);
  }
  canvas.text(group.name, {left + 0.5 * layout.group_width, bottom + 0.8 * kRow}, kTextSize, Anchor::kCentre);
}
}  // namespace

cv::Mat draw_bar_chart(const BarChart& chart) {
  for (const auto& group : chart.groups) {
    if (group.values.size() != chart.series.size()) {
      throw InputError("bar chart: group '" + group.name + "' has " + std::to_string(group.values.size()) +
                       " values for " + std::to_string(chart.series.size()) + " series");
    }
  }
  const Layout layout = lay_out(chart);
  Canvas canvas(static_cast<int>(std::ceil(layout.width)), static_cast<int>(std::ceil(layout.height)));
  canvas.text(chart.title, {kAxisRoom, kMargin + 0.5 * kTitleSize}, kTitleSize, Anchor::kLeft, true);
  for (const auto& [at, series] : layout.legend) {
    canvas.rectangle({at.x, at.y - 0.5 * kSample, kSample, kSample}, line_colour(series));
    canvas.text(chart.series[series], {at.x + kSample + 6.0, at.y}, kTextSize, Anchor::kLeft);
  }
  draw_axis(canvas, chart, layout);
  double left = layout.diagram.x + 0.5 * kGroupGap;
  for (const auto& group : chart.groups) {
    draw_group(canvas, chart, group, left, layout);
    left += layout.group_width + kGroupGap;
  }
  const cv::Rect2d& box = layout.diagram;
  canvas.line({{box.x, box.y}, {box.x, box.y + box.height}, {box.x + box.width, box.y + box.height}},
              {{90, 90, 90}, 1.4});
  return canvas.image();
}

}  // namespace roslam::evaluation
