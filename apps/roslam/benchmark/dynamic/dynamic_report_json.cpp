// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/roslam/benchmark/benchmark_metrics.hpp"
#include "apps/roslam/benchmark/dynamic/dynamic_report.hpp"
#include "evaluation/plots/bar_chart.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
using Json = nlohmann::ordered_json;

Json by_mode(const DynamicReport& report, const std::vector<BenchmarkedSequence>& results) {
  Json json = Json::object();
  for (std::size_t i = 0; i < results.size(); ++i) json[report.modes[i]] = json_of(results[i]);
  return json;
}
}  // namespace

// The systems that the modes correspond to in the tables of the paper.
std::string title_of_mode(const std::string& mode) {
  if (mode == "none") return "none (ORB-SLAM2-like)";
  if (mode == "both") return "both (RO-SLAM)";
  return mode;
}

double ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode) {
  return mode < results.size() ? median_of(results[mode], ate_of) : std::numeric_limits<double>::quiet_NaN();
}

double whole_ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode) {
  const bool is_whole = mode < results.size() &&
                        results[mode].complete_runs().size() == results[mode].runs.size() &&
                        median_of(results[mode], tracked_share_of) >= kAllTracked;
  return is_whole ? ate_in(results, mode) : std::numeric_limits<double>::quiet_NaN();
}

cv::Mat dynamic_bars(const DynamicReport& report) {
  BarChart chart;
  chart.title = "Absolute trajectory error by mode of --dynamic";
  chart.value_label = "ATE RMSE [m], logarithmic";
  for (const auto& mode : report.modes) chart.series.push_back(title_of_mode(mode));
  bool has_any = false;
  const auto add = [&](const std::string& name, const std::vector<BenchmarkedSequence>& results) {
    BarGroup group{name, {}};
    for (std::size_t i = 0; i < report.modes.size(); ++i) group.values.push_back(whole_ate_in(results, i));
    has_any |=
        std::any_of(group.values.begin(), group.values.end(), [](double v) { return std::isfinite(v); });
    chart.groups.push_back(std::move(group));
  };
  for (const auto& result : report.results) {
    add(result.sequence.name, result.by_mode);
    if (result.has_counterpart) add("static counterpart", result.counterpart_by_mode);
  }
  return has_any ? draw_bar_chart(chart) : cv::Mat();
}

std::string dynamic_json(const DynamicReport& report) {
  Json json = head_json("dynamic", report);
  json["removal_modes"] = report.modes;
  json["bars"] = report.bars.empty() ? Json(nullptr) : Json(report.bars);
  json["sequences"] = Json::array();
  for (const auto& result : report.results) {
    Json sequence{{"name", result.sequence.name}};
    sequence["figure"] = result.figure.empty() ? Json(nullptr) : Json(result.figure);
    sequence["by_mode"] = by_mode(report, result.by_mode);
    sequence["nothing_moving"] =
        result.has_counterpart ? by_mode(report, result.counterpart_by_mode) : Json(nullptr);
    sequence["removal"] = Json::object();
    for (std::size_t i = 0; i < result.removal.size(); ++i) {
      if (result.removal[i]) sequence["removal"][report.modes[i]] = Json::parse(to_json(*result.removal[i]));
    }
    json["sequences"].push_back(std::move(sequence));
  }
  return text_of(json);
}

}  // namespace roslam::app
