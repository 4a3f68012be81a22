// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/plots/plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace roslam::evaluation {

namespace {
// Sizes in pixels; of text the height of a capital letter.
constexpr double kTitleSize = 12.0;
constexpr double kLabelSize = 10.5;
constexpr double kTickSize = 9.0;
constexpr double kMargin = 14.0;
constexpr double kRowHeight = 22.0;
constexpr double kLegendSample = 30.0;
constexpr double kLegendGap = 22.0;
constexpr double kLegendIndent = 58.0;  // about where the diagram begins
constexpr double kTickLength = 5.0;
constexpr double kBarWidth = 14.0;
constexpr double kPixelsPerTick = 55.0;
constexpr double kPadding = 0.05;  // of the data's range, on each side
constexpr double kMarkerRadius = 5.5;
constexpr double kLeastSpan = 1e-6;  // of an axis in its unit: below it there is only rounding noise

bool is_finite(const cv::Point2d& point) { return std::isfinite(point.x) && std::isfinite(point.y); }

std::string shortened(const std::string& words, double size, double width) {
  if (Canvas::text_width(words, size) <= width) return words;
  std::string start = words;
  while (!start.empty() && Canvas::text_width(start + "...", size) > width) start.pop_back();
  return start + "...";
}

double widest(const std::vector<std::string>& labels) {
  double width = 0.0;
  for (const auto& label : labels) width = std::max(width, Canvas::text_width(label, kTickSize));
  return width;
}

int tick_count(double pixels) { return std::max(2, static_cast<int>(pixels / kPixelsPerTick)); }

// A range of no extent, or of none but rounding noise, would stretch that noise over the whole axis.
Range padded(Range range, bool from_zero) {
  const double magnitude = std::max(std::abs(range.min), std::abs(range.max));
  if (range.span() <= std::max(1e-9 * magnitude, kLeastSpan)) {
    const double room = std::max(0.1 * magnitude, kLeastSpan);
    range = {range.min - room, range.max + room};
  }
  const double room = kPadding * range.span();
  return {from_zero ? 0.0 : range.min - room, range.max + room};
}

void widen(Range& range, double span) {
  const double room = 0.5 * (span - range.span());
  range = {range.min - room, range.max + room};
}
}  // namespace

struct Plot::LegendEntry {
  const Line* line;
  cv::Point2d at;  // left end of the sample
  std::string words;
};

struct Plot::Axes {
  cv::Rect2d box;
  Range x;
  Range y;
  std::vector<double> x_ticks;
  std::vector<double> y_ticks;
  double y_label_x = 0.0;

  cv::Point2d at(const cv::Point2d& point) const {
    return {box.x + (point.x - x.min) / x.span() * box.width,
            box.y + box.height - (point.y - y.min) / y.span() * box.height};
  }
};

void Plot::set_labels(std::string x, std::string y) {
  x_label_ = std::move(x);
  y_label_ = std::move(y);
}

void Plot::add_line(std::vector<cv::Point2d> points, const LineStyle& style, const std::string& label) {
  lines_.push_back({std::move(points), {}, style, label});
}

void Plot::add_coloured_line(std::vector<cv::Point2d> points, std::vector<double> values,
                             std::string bar_label, const std::string& label) {
  bar_label_ = std::move(bar_label);
  lines_.push_back({std::move(points), std::move(values), {scale_colour(0.25), 2.6, false}, label});
}

void Plot::add_level(double y, const LineStyle& style, const std::string& label) {
  lines_.push_back({{{0.0, y}}, {}, style, label, true});
}

void Plot::add_marker(const cv::Point2d& at, const Colour& colour, const std::string& label) {
  lines_.push_back({{at}, {}, {colour}, label, false, true});
}

Range Plot::range_of(bool of_x) const {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const auto& line : lines_) {
    if (of_x && line.is_level) continue;
    for (const auto& point : line.points) {
      if (!is_finite(point)) continue;
      range.min = std::min(range.min, of_x ? point.x : point.y);
      range.max = std::max(range.max, of_x ? point.x : point.y);
    }
  }
  return range.min <= range.max ? range : Range{0.0, 1.0};
}

Range Plot::value_range() const {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const auto& line : lines_) {
    for (const double value : line.values) {
      range.min = std::min(range.min, value);
      range.max = std::max(range.max, value);
    }
  }
  if (!(range.min <= range.max)) return {0.0, 1.0};
  return {range.min, std::max(range.max, range.min + kLeastSpan)};
}

// In rows below the title: inside the diagram it would cover lines.
std::vector<Plot::LegendEntry> Plot::legend(const cv::Rect2d& area) const {
  const double left = area.x + kLegendIndent;
  const double right = area.x + area.width - kMargin;
  cv::Point2d at(left, area.y + kMargin + kTitleSize + 6.0 + 0.5 * kRowHeight);
  std::vector<LegendEntry> entries;
  for (const auto& line : lines_) {
    if (line.label.empty()) continue;
    const std::string words = shortened(line.label, kTickSize, right - left - kLegendSample);
    const double width = kLegendSample + Canvas::text_width(words, kTickSize);
    if (at.x > left && at.x + width > right) at = {left, at.y + kRowHeight};
    entries.push_back({&line, at, words});
    at.x += width + kLegendGap;
  }
  return entries;
}

Plot::Axes Plot::lay_out(const cv::Rect2d& area) const {
  Axes axes;
  axes.x = padded(range_of(true), false);
  axes.y = padded(range_of(false), y_from_zero_);
  if (!equal_aspect_) {  // time runs from edge to edge
    const Range tight = range_of(true);
    if (tight.span() > 0.0) axes.x = tight;
  }
  const auto entries = legend(area);
  const double top =
      entries.empty() ? area.y + kMargin + kTitleSize + 12.0 : entries.back().at.y + 0.5 * kRowHeight + 6.0;
  const double bottom = area.y + area.height - kMargin - kLabelSize - 14.0 - kTickSize - kTickLength;
  const double height = bottom - top;

  double right = area.x + area.width - kMargin - 10.0;
  if (!bar_label_.empty()) {
    const double labels = widest(tick_labels(nice_ticks(value_range(), tick_count(height))));
    right = area.x + area.width - kMargin - kLabelSize - 10.0 - labels - 8.0 - kBarWidth - 12.0;
  }
  // The space for labels depends on the ticks, these on the range, that (for equal aspect) on the space: two
  // iterations converge.
  double left = area.x + kMargin + kLabelSize + 50.0;
  for (int round = 0; round < 2; ++round) {
    const double width = right - left;
    if (equal_aspect_) {
      const double unit = std::max(axes.x.span() / width, axes.y.span() / height);
      widen(axes.x, unit * width);
      widen(axes.y, unit * height);
    }
    axes.y_ticks = nice_ticks(axes.y, tick_count(height));
    left = area.x + kMargin + kLabelSize + 10.0 + widest(tick_labels(axes.y_ticks)) + 6.0 + kTickLength;
  }
  axes.box = {left, top, right - left, height};
  if (equal_aspect_) widen(axes.x, axes.y.span() / height * axes.box.width);
  axes.x_ticks =
      nice_ticks(axes.x, tick_count(axes.box.width / 1.3));  // labels lie side by side: more room each
  axes.y_label_x = area.x + kMargin + 0.5 * kLabelSize;
  return axes;
}

void Plot::draw_legend(Canvas& canvas, const cv::Rect2d& area) const {
  for (const auto& [line, at, words] : legend(area)) {
    const cv::Point2d end = at + cv::Point2d(kLegendSample - 8.0, 0.0);
    if (line->is_marker) {
      canvas.disc(0.5 * (at + end), kMarkerRadius, line->style.colour);
    } else if (line->values.empty()) {
      canvas.line({at, end}, line->style);
    } else {
      const double width = end.x - at.x;
      for (int x = 0; x < width; ++x) {
        canvas.rectangle({at.x + x, at.y - 2.0, 1.0, 4.0}, scale_colour(x / width));
      }
    }
    canvas.text(words, at + cv::Point2d(kLegendSample, 0.0), kTickSize, Anchor::kLeft);
  }
}

void Plot::draw_frame(Canvas& canvas, const Axes& axes) const {
  const LineStyle grid{{228, 228, 228}, 1.0};
  const LineStyle frame{{90, 90, 90}, 1.2};
  const cv::Rect2d& box = axes.box;
  const double bottom = box.y + box.height;
  const double right = box.x + box.width;
  const auto x_labels = tick_labels(axes.x_ticks);
  const auto y_labels = tick_labels(axes.y_ticks);
  for (std::size_t i = 0; i < axes.x_ticks.size(); ++i) {
    const double x = axes.at({axes.x_ticks[i], axes.y.min}).x;
    canvas.line({{x, box.y}, {x, bottom}}, grid);
    canvas.line({{x, bottom}, {x, bottom + kTickLength}}, frame);
    canvas.text(x_labels[i], {x, bottom + kTickLength + 5.0 + 0.5 * kTickSize}, kTickSize, Anchor::kCentre);
  }
  for (std::size_t i = 0; i < axes.y_ticks.size(); ++i) {
    const double y = axes.at({axes.x.min, axes.y_ticks[i]}).y;
    canvas.line({{box.x, y}, {right, y}}, grid);
    canvas.line({{box.x - kTickLength, y}, {box.x, y}}, frame);
    canvas.text(y_labels[i], {box.x - kTickLength - 5.0, y}, kTickSize, Anchor::kRight);
  }
  canvas.line({{box.x, box.y}, {right, box.y}, {right, bottom}, {box.x, bottom}, {box.x, box.y}}, frame);
  const double x_label_y = bottom + kTickLength + 5.0 + kTickSize + 9.0 + 0.5 * kLabelSize;
  canvas.text(x_label_, {box.x + 0.5 * box.width, x_label_y}, kLabelSize, Anchor::kCentre);
  canvas.text_upwards(y_label_, {axes.y_label_x, box.y + 0.5 * box.height}, kLabelSize);
}

void Plot::draw_lines(Canvas& canvas, const Axes& axes) const {
  const Range values = value_range();
  canvas.clip_to(axes.box);
  for (const auto& line : lines_) {
    if (line.is_marker) {
      canvas.disc(axes.at(line.points.front()), kMarkerRadius, line.style.colour);
    } else if (line.is_level) {
      const double y = line.points.front().y;
      canvas.line({axes.at({axes.x.min, y}), axes.at({axes.x.max, y})}, line.style);
    } else if (line.values.empty()) {
      std::vector<cv::Point2d> piece;
      for (const auto& point : line.points) {
        if (is_finite(point)) {
          piece.push_back(axes.at(point));
        } else {
          canvas.line(std::exchange(piece, {}), line.style);
        }
      }
      canvas.line(piece, line.style);
    } else {
      for (std::size_t i = 1; i < line.points.size(); ++i) {
        if (!is_finite(line.points[i - 1]) || !is_finite(line.points[i])) continue;
        const Colour colour = scale_colour((line.values[i] - values.min) / values.span());
        canvas.line({axes.at(line.points[i - 1]), axes.at(line.points[i])}, {colour, line.style.width});
      }
    }
  }
  canvas.unclip();
}

void Plot::draw_colour_bar(Canvas& canvas, const Axes& axes) const {
  const Range values = value_range();
  const cv::Rect2d bar(axes.box.x + axes.box.width + 12.0, axes.box.y, kBarWidth, axes.box.height);
  const double bottom = bar.y + bar.height;
  for (int y = 0; y < bar.height; ++y) {
    const double height = std::min(1.0, bar.height - y);
    canvas.rectangle({bar.x, bottom - y - height, bar.width, height}, scale_colour(y / bar.height));
  }
  const auto ticks = nice_ticks(values, tick_count(bar.height));
  const auto labels = tick_labels(ticks);
  const double right = bar.x + bar.width;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = bottom - (ticks[i] - values.min) / values.span() * bar.height;
    canvas.line({{right, y}, {right + 4.0, y}}, {{90, 90, 90}, 1.2});
    canvas.text(labels[i], {right + 8.0, y}, kTickSize, Anchor::kLeft);
  }
  const double label_x = right + 8.0 + widest(labels) + 10.0 + 0.5 * kLabelSize;
  canvas.text_upwards(bar_label_, {label_x, bar.y + 0.5 * bar.height}, kLabelSize);
}

void Plot::draw(Canvas& canvas, const cv::Rect2d& area) const {
  const Axes axes = lay_out(area);
  const double title_y = area.y + kMargin + 0.5 * kTitleSize;
  canvas.text(shortened(title_, kTitleSize, area.width - 2.0 * kMargin),
              {axes.box.x + 0.5 * axes.box.width, title_y}, kTitleSize, Anchor::kCentre, true);
  draw_legend(canvas, area);
  draw_frame(canvas, axes);
  draw_lines(canvas, axes);
  if (!bar_label_.empty()) draw_colour_bar(canvas, axes);
}

}  // namespace roslam::evaluation
