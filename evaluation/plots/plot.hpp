// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "evaluation/plots/canvas.hpp"

namespace roslam::evaluation {

struct Range {
  double min = 0.0;
  double max = 0.0;
  double span() const { return max - min; }
};

/// Multiples of 1, 2 or 5 times a power of ten within the range: at most max_count, and at least two if
/// max_count allows. The range must be finite and not empty.
std::vector<double> nice_ticks(const Range& range, int max_count);

/// The ticks as text, all with the decimals their step needs.
std::vector<std::string> tick_labels(const std::vector<double>& ticks);

/// Colour of a value on the scale from 0 (blue) over green to 1 (red); values outside are clamped.
Colour scale_colour(double share);

/// Eight colours that colour-blind readers can tell apart too (Okabe and Ito); then they repeat.
Colour line_colour(std::size_t index);

/// A line in that colour; dashed where the colour is a repeated one.
LineStyle line_style(std::size_t index);

/// One diagram: axes, grid, lines, legend and colour bar, laid out so that nothing overlaps.
class Plot {
 public:
  explicit Plot(std::string title) : title_(std::move(title)) {}

  void set_labels(std::string x, std::string y);
  /// Equal scale of both axes: for maps.
  void set_equal_aspect() { equal_aspect_ = true; }
  /// The y axis starts at zero: for errors.
  void set_y_from_zero() { y_from_zero_ = true; }

  /// A line through the points; one that is not finite interrupts it. An empty label keeps it out of the
  /// legend.
  void add_line(std::vector<cv::Point2d> points, const LineStyle& style, const std::string& label = "");
  /// A line whose piece from point i - 1 to i has the colour of values[i], with a colour bar beside the
  /// diagram.
  void add_coloured_line(std::vector<cv::Point2d> points, std::vector<double> values, std::string bar_label,
                         const std::string& label = "");
  /// A level line across the whole diagram.
  void add_level(double y, const LineStyle& style, const std::string& label = "");
  /// A dot with an entry in the legend.
  void add_marker(const cv::Point2d& at, const Colour& colour, const std::string& label);

  /// Draws everything into an area of the canvas.
  void draw(Canvas& canvas, const cv::Rect2d& area) const;

 private:
  struct Line {
    std::vector<cv::Point2d> points;
    std::vector<double> values;  // one a point for a coloured line, else none
    LineStyle style;
    std::string label;
    bool is_level = false;
    bool is_marker = false;
  };
  struct Axes;  // where the diagram lies on the canvas and which range it shows
  struct LegendEntry;

  Range range_of(bool of_x) const;
  Range value_range() const;
  std::vector<LegendEntry> legend(const cv::Rect2d& area) const;
  Axes lay_out(const cv::Rect2d& area) const;
  void draw_legend(Canvas& canvas, const cv::Rect2d& area) const;
  void draw_frame(Canvas& canvas, const Axes& axes) const;
  void draw_lines(Canvas& canvas, const Axes& axes) const;
  void draw_colour_bar(Canvas& canvas, const Axes& axes) const;

  std::string title_;
  std::string x_label_;
  std::string y_label_;
  std::string bar_label_;
  bool equal_aspect_ = false;
  bool y_from_zero_ = false;
  std::vector<Line> lines_;
};

}  // namespace roslam::evaluation
