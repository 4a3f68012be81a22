// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace roslam::evaluation {

/// Some values side by side, such as the errors of one sequence by method.
struct BarGroup {
  std::string name;
  std::vector<double> values;  ///< one a series; one that is not finite or not above 0 gets a "-" and no bar
};

struct BarChart {
  std::string title;
  std::string value_label;          ///< of the value axis, with its unit
  std::vector<std::string> series;  ///< names for the legend, in the order of the values
  std::vector<BarGroup> groups;
  int decimals = 4;  ///< of the value printed above each bar
};

/// The chart as an image (CV_8UC3). The scale is logarithmic, as errors differ by factors, and each bar is
/// labelled with its value. Throws InputError if a group has not one value a series.
cv::Mat draw_bar_chart(const BarChart& chart);

}  // namespace roslam::evaluation
