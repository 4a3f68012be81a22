// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trajectory_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::evaluation {

namespace {
using Json = nlohmann::ordered_json;
using Value = std::function<double(const TrajectoryError&)>;

struct Column {
  std::string title;
  int decimals;
  Value value;
};

std::vector<Column> absolute_columns(bool with_scale) {
  std::vector<Column> columns{
      {"pairs", 0, [](const auto& e) { return static_cast<double>(e.pairs); }},
      {"covered %", 1, [](const auto& e) { return 100.0 * e.coverage; }},
      {"wrong frames", 0, [](const auto& e) { return static_cast<double>(e.wrong_frames.size()); }},
      {"path m", 3, [](const auto& e) { return e.path_length; }},
      {"RMSE m", 4, [](const auto& e) { return e.ate.rmse; }},
      {"mean m", 4, [](const auto& e) { return e.ate.mean; }},
      {"median m", 4, [](const auto& e) { return e.ate.median; }},
      {"std m", 4, [](const auto& e) { return e.ate.std_dev; }},
      {"min m", 4, [](const auto& e) { return e.ate.min; }},
      {"max m", 4, [](const auto& e) { return e.ate.max; }},
      {"RMSE % of path", 3, [](const auto& e) { return e.ate_percent; }},
  };
  if (with_scale) columns.push_back({"scale", 5, [](const auto& e) { return e.alignment.scale; }});
  return columns;
}

std::vector<Column> relative_columns(double span) {
  std::array<char, 32> over{};
  std::snprintf(over.data(), over.size(), "%g s: ", span);
  const std::string span_name = over.data();
  return {
      {"frame: RMSE m", 5, [](const auto& e) { return e.rpe_frame.translation.rmse; }},
      {"median m", 5, [](const auto& e) { return e.rpe_frame.translation.median; }},
      {"RMSE deg", 4, [](const auto& e) { return e.rpe_frame.rotation.rmse; }},
      {"median deg", 4, [](const auto& e) { return e.rpe_frame.rotation.median; }},
      {span_name + "RMSE m", 5, [](const auto& e) { return e.rpe_span.translation.rmse; }},
      {"median m", 5, [](const auto& e) { return e.rpe_span.translation.median; }},
      {"RMSE deg", 4, [](const auto& e) { return e.rpe_span.rotation.rmse; }},
      {"median deg", 4, [](const auto& e) { return e.rpe_span.rotation.median; }},
  };
}

double median_of(const std::vector<EvaluatedTrajectory>& runs, const Value& value) {
  std::vector<double> values;
  for (const auto& run : runs) {
    if (const double one = value(run.error); std::isfinite(one)) values.push_back(one);
  }
  return median(std::move(values));
}

std::string table_of(const TrajectoryReport& report, const std::vector<Column>& columns) {
  std::vector<TableRow> rows{{"trajectory"}};
  for (const auto& column : columns) rows.front().push_back(column.title);
  const auto add = [&](const EvaluatedTrajectory& trajectory) {
    rows.push_back({table_cell(trajectory.name)});
    for (const auto& column : columns)
      rows.back().push_back(fixed(column.value(trajectory.error), column.decimals));
  };
  std::for_each(report.runs.begin(), report.runs.end(), add);
  if (report.runs.size() > 1) {
    rows.push_back({"median of " + std::to_string(report.runs.size()) + " runs"});
    for (const auto& column : columns) {
      rows.back().push_back(fixed(median_of(report.runs, column.value), column.decimals));
    }
  }
  std::for_each(report.others.begin(), report.others.end(), add);
  return markdown_table(rows);
}

Json json_of(const Statistics& s) {
  return {{"count", s.count},           {"rmse", number(s.rmse)},   {"mean", number(s.mean)},
          {"median", number(s.median)}, {"std", number(s.std_dev)}, {"min", number(s.min)},
          {"max", number(s.max)}};
}

Json json_of(const RelativeError& error) {
  return {{"translation_m", json_of(error.translation)}, {"rotation_deg", json_of(error.rotation)}};
}

Json json_of(const std::vector<WrongFrame>& frames) {
  Json json = Json::array();
  for (const WrongFrame& frame : frames)
    json.push_back({{"time_s", frame.timestamp},
                    {"step_error_m", number(frame.metres)},
                    {"step_error_deg", number(frame.degrees)}});
  return json;
}

Json json_of(const EvaluatedTrajectory& trajectory) {
  const TrajectoryError& e = trajectory.error;
  return {{"name", trajectory.name},
          {"file", trajectory.file},
          {"skipped_lines", trajectory.skipped_lines},
          {"poses", e.estimate_poses},
          {"pairs", e.pairs},
          {"coverage", number(e.coverage)},
          {"wrong_frames", e.wrong_frames.size()},
          {"wrong", json_of(e.wrong_frames)},
          {"path_length_m", number(e.path_length)},
          {"scale", number(e.alignment.scale)},
          {"ate_m", json_of(e.ate)},
          {"ate_percent_of_path", number(e.ate_percent)},
          {"rpe_frame", json_of(e.rpe_frame)},
          {"rpe_span", json_of(e.rpe_span)}};
}

Json json_of_median(const std::vector<EvaluatedTrajectory>& runs) {
  const auto of = [&](const Value& value) { return number(median_of(runs, value)); };
  return {{"coverage", of([](const auto& e) { return e.coverage; })},
          {"wrong_frames", of([](const auto& e) { return static_cast<double>(e.wrong_frames.size()); })},
          {"ate_rmse_m", of([](const auto& e) { return e.ate.rmse; })},
          {"ate_median_m", of([](const auto& e) { return e.ate.median; })},
          {"ate_max_m", of([](const auto& e) { return e.ate.max; })},
          {"ate_percent_of_path", of([](const auto& e) { return e.ate_percent; })},
          {"rpe_frame_rmse_m", of([](const auto& e) { return e.rpe_frame.translation.rmse; })},
          {"rpe_frame_rmse_deg", of([](const auto& e) { return e.rpe_frame.rotation.rmse; })},
          {"rpe_span_rmse_m", of([](const auto& e) { return e.rpe_span.translation.rmse; })},
          {"rpe_span_rmse_deg", of([](const auto& e) { return e.rpe_span.rotation.rmse; })}};
}
}  // namespace

std::string to_markdown(const TrajectoryReport& report) {
  const bool with_scale = report.options.alignment == AlignmentModel::kSimilarity;
  std::string text = "Absolute trajectory error, aligned by ";
  text += with_scale ? "Sim(3) (rotation, translation and scale)" : "SE(3) (rotation and translation)";
  text += "\n\n" + table_of(report, absolute_columns(with_scale));
  text += "\nRelative pose error, from frame to frame and over a span of time\n\n";
  return text + table_of(report, relative_columns(report.options.span));
}

std::string to_json(const TrajectoryReport& report) {
  const bool with_scale = report.options.alignment == AlignmentModel::kSimilarity;
  Json json{{"truth", report.truth_file},
            {"alignment", with_scale ? "sim3" : "se3"},
            {"max_time_difference_s", report.options.association.max_time_difference},
            {"interpolate", report.options.association.interpolate},
            {"span_s", report.options.span},
            {"median", json_of_median(report.runs)},
            {"estimates", Json::array()},
            {"against", Json::array()}};
  for (const auto& run : report.runs) json["estimates"].push_back(json_of(run));
  for (const auto& other : report.others) json["against"].push_back(json_of(other));
  // File names may hold any bytes; those that are not UTF-8 are replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::evaluation
