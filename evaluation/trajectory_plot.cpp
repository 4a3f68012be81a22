// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trajectory_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "evaluation/plots/plot.hpp"
#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::evaluation {

namespace {
constexpr int kWidth = 1670;
constexpr int kHeight = 720;
constexpr double kGutter = 30.0;  // between the two diagrams

LineStyle truth_style() { return {{130, 130, 130}, 1.8, true}; }
Colour start_colour() { return {80, 160, 40}; }
Colour end_colour() { return {40, 40, 200}; }

struct View {
  int right = 0;  // axis that points to the right of the map
  int up = 1;     // axis that points up the map
  int height = 2;
  double height_sign = 1.0;

  cv::Point2d map(const Eigen::Vector3d& p) const { return {p[right], p[up]}; }
};

View choose_view(const Trajectory& trajectory, WorldUp up) {
  if (up == WorldUp::kZ) return {0, 1, 2, 1.0};
  if (up == WorldUp::kMinusY) return {0, 2, 1, -1.0};
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (const auto& pose : trajectory) {
    low = low.cwiseMin(pose.T_world_camera.translation());
    high = high.cwiseMax(pose.T_world_camera.translation());
  }
  const Eigen::Vector3d extent = high - low;
  // Among equal extents z is dropped first: in most world frames z is up.
  if (extent.x() < extent.y() && extent.x() < extent.z()) return {1, 2, 0, 1.0};
  if (extent.y() < extent.z()) return {0, 2, 1, 1.0};
  return {0, 1, 2, 1.0};
}

char axis_name(int axis) { return "xyz"[axis]; }

std::string axis_label(int axis, double sign = 1.0) {
  return std::string(sign < 0.0 ? "-" : "") + axis_name(axis) + " [m]";
}

std::string map_title(const View& view, WorldUp up) {
  if (up != WorldUp::kUnknown) return "Trajectory from above";
  return std::string("Trajectory in the ") + axis_name(view.right) + "-" + axis_name(view.up) + " plane";
}

std::string metres(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4f m", value);
  return text.data();
}

cv::Point2d gap() {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  return {kNaN, kNaN};
}

// A line through samples in time, interrupted at tracking gaps, where a straight line would show poses that
// the estimate does not have. Values, one a point, are kept aligned with the points.
struct TimedLine {
  std::vector<cv::Point2d> points;
  std::vector<double> values;
};

TimedLine interrupted(const std::vector<double>& times, const std::vector<cv::Point2d>& points,
                      const std::vector<double>& values) {
  const double longest = longest_step(times);
  TimedLine line;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (i > 0 && times[i] - times[i - 1] > longest) {
      line.points.push_back(gap());
      line.values.push_back(values[i]);
    }
    line.points.push_back(points[i]);
    line.values.push_back(values[i]);
  }
  return line;
}

TimedLine path_of(const TrajectoryError& error, const View& view) {
  std::vector<double> times;
  std::vector<cv::Point2d> points;
  std::vector<double> values;
  for (const auto& pose : error.poses) {
    times.push_back(pose.timestamp);
    points.push_back(view.map(pose.estimate));
    values.push_back(pose.error);
  }
  return interrupted(times, points, values);
}

TimedLine error_over_time(const TrajectoryError& error, double start) {
  std::vector<double> times;
  std::vector<cv::Point2d> points;
  std::vector<double> values;
  for (const auto& pose : error.poses) {
    times.push_back(pose.timestamp);
    points.emplace_back(pose.timestamp - start, pose.error);
    values.push_back(pose.error);
  }
  return interrupted(times, points, values);
}

TimedLine map_of(const Trajectory& trajectory, const View& view, double start) {
  std::vector<double> times;
  std::vector<cv::Point2d> points;
  std::vector<double> values;
  for (const auto& [timestamp, pose] : trajectory) {
    times.push_back(timestamp);
    points.push_back(view.map(pose.translation()));
    values.push_back(timestamp - start);
  }
  return interrupted(times, points, values);
}

Plot paths_plot(const Trajectory& truth, const std::vector<NamedTrajectoryError>& estimates, WorldUp up) {
  const bool single = estimates.size() == 1;
  const View view = choose_view(truth, up);
  Plot plot(map_title(view, up));
  plot.set_equal_aspect();
  plot.set_labels(axis_label(view.right), axis_label(view.up));
  plot.add_line(map_of(truth, view, 0.0).points, truth_style(), "truth");
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    auto [points, values] = path_of(estimates[i].error, view);
    if (single) {
      plot.add_coloured_line(std::move(points), std::move(values), "absolute error [m]", estimates[i].name);
    } else {
      plot.add_line(std::move(points), line_style(i), estimates[i].name);
    }
  }
  return plot;
}

Plot errors_plot(const std::vector<NamedTrajectoryError>& estimates) {
  Plot plot("Absolute trajectory error over time");
  plot.set_y_from_zero();
  plot.set_labels("time [s]", "absolute error [m]");
  double start = std::numeric_limits<double>::infinity();
  for (const auto& estimate : estimates) start = std::min(start, estimate.error.poses.front().timestamp);
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const auto& [name, error] = estimates[i];
    const bool single = estimates.size() == 1;
    plot.add_line(error_over_time(error, start).points, line_style(i),
                  single ? "error" : name + " (RMSE " + metres(error.ate.rmse) + ")");
    if (!single) continue;
    plot.add_level(error.ate.rmse, {line_colour(1), 1.8, true}, "RMSE " + metres(error.ate.rmse));
    plot.add_level(error.ate.mean, {line_colour(2), 1.8, true}, "mean " + metres(error.ate.mean));
    plot.add_level(error.ate.median, {line_colour(7), 1.8, true}, "median " + metres(error.ate.median));
  }
  return plot;
}

cv::Mat side_by_side(const Plot& left, const Plot& right) {
  Canvas canvas(kWidth, kHeight);
  const double width = 0.5 * (kWidth - kGutter);
  left.draw(canvas, {0.0, 0.0, width, kHeight});
  right.draw(canvas, {width + kGutter, 0.0, width, kHeight});
  return canvas.image();
}
}  // namespace

cv::Mat plot_trajectory_errors(const Trajectory& truth, const std::vector<NamedTrajectoryError>& estimates,
                               WorldUp up) {
  const bool drawable = std::all_of(estimates.begin(), estimates.end(),
                                    [](const NamedTrajectoryError& e) { return !e.error.poses.empty(); });
  if (truth.empty() || !drawable) throw InputError("a trajectory without poses cannot be drawn");
  return side_by_side(paths_plot(truth, estimates, up), errors_plot(estimates));
}

cv::Mat plot_trajectory(const Trajectory& trajectory, const std::string& name, WorldUp up) {
  if (trajectory.empty()) throw InputError("a trajectory without poses cannot be drawn");
  const View view = choose_view(trajectory, up);
  const double start = trajectory.front().timestamp;
  auto [points, values] = map_of(trajectory, view, start);
  const cv::Point2d first = points.front();
  const cv::Point2d last = points.back();

  Plot map(map_title(view, up));
  map.set_equal_aspect();
  map.set_labels(axis_label(view.right), axis_label(view.up));
  map.add_coloured_line(std::move(points), std::move(values), "time [s]", name);
  map.add_marker(first, start_colour(), "start");
  map.add_marker(last, end_colour(), "end");

  std::vector<double> times;
  std::vector<cv::Point2d> heights;
  for (const auto& [timestamp, pose] : trajectory) {
    times.push_back(timestamp);
    heights.emplace_back(timestamp - start, view.height_sign * pose.translation()[view.height]);
  }
  const std::string label = axis_label(view.height, view.height_sign);
  Plot height(up == WorldUp::kUnknown ? "Third axis over time" : "Height over time");
  height.set_labels("time [s]", up == WorldUp::kUnknown ? label : "height " + label);
  height.add_line(interrupted(times, heights, times).points, line_style(0));
  return side_by_side(map, height);
}

void write_png(const std::filesystem::path& file, const cv::Mat& image) {
  if (file.extension() != ".png") {
    throw OutputError(file.string() + ": figures are written as PNG; give a name that ends in .png");
  }
  write_image(file, image);
}

}  // namespace roslam::evaluation
