// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_report.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/roslam/benchmark/benchmark_metrics.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
using Json = nlohmann::ordered_json;

std::string table_of_runs(const BenchmarkedSequence& sequence) {
  std::vector<TableRow> rows{{"run"}};
  for (const auto& metric : benchmark_metrics()) rows.front().push_back(metric.title);
  std::ostringstream remarks;
  for (std::size_t i = 0; i < sequence.runs.size(); ++i) {
    const BenchmarkRun& run = sequence.runs[i];
    const std::string number = std::to_string(i + 1);
    if (run.is_complete()) {
      rows.push_back({number});
      for (const auto& metric : benchmark_metrics()) rows.back().push_back(metric.cell(metric.of(run)));
      if (!run.error) remarks << "\nRun " << number << " has no accuracy: " << run.no_error_reason << ".\n";
    } else {
      const std::string what = run.is_interrupted ? "was interrupted" : "failed: " + run.failure;
      remarks << "\nRun " << number << " " << what << ".\n";
    }
  }
  if (rows.size() > 2) {
    rows.push_back({"median"});
    for (const auto& metric : benchmark_metrics())
      rows.back().push_back(metric.cell(median_of(sequence, metric.of)));
  }
  return (rows.size() > 1 ? markdown_table(rows) : std::string()) + remarks.str();
}

std::string table_of_stages(const BenchmarkedSequence& sequence) {
  std::vector<TableRow> rows{{"stage", "times", "median ms", "p95 ms", "longest ms"}};
  for (const auto& stage : stages_of(sequence)) {
    rows.push_back({table_cell(stage), fixed(stage_count(sequence, stage), 0),
                    fixed(stage_median(sequence, stage, &StageSummary::median_ms), 2),
                    fixed(stage_median(sequence, stage, &StageSummary::p95_ms), 2),
                    fixed(stage_median(sequence, stage, &StageSummary::max_ms), 2)});
  }
  return rows.size() > 1 ? "\nProcessor time of each stage\n\n" + markdown_table(rows) : "";
}

std::string section_of(const BenchmarkedSequence& sequence) {
  const auto& [name, source, camera, truth] = sequence.sequence;
  std::ostringstream text;
  text << "\n## " << name << "\n\nSource `" << source << "`";
  if (!camera.empty()) text << ", camera `" << camera << "`";
  text << ".";
  if (sequence.repeats)
    text << (*sequence.repeats ? " Every run gave the same trajectory." : " The runs differ.");
  text << "\n\n" << table_of_runs(sequence) << table_of_stages(sequence);
  if (!sequence.figure.empty()) text << "\n![Trajectories of " << name << "](" << sequence.figure << ")\n";
  return text.str();
}

constexpr auto kLegend = R"(
- tracked: share of the sequence's frames with a pose; dropped: frames that arrived while the tracker was
  busy.
- ATE: absolute trajectory error after SE(3) alignment of the whole trajectory; RPE: relative pose error from
  frame to frame and over one second; RMSE.
- tracking, p95: median and 95th percentile of the processor time of the tracking thread for a frame, from the
  image to its pose; reading the image is not part of it.
- memory: peak of a run's process; start-up: from the start of the process to the first pose. For simulated
  flights both include the simulation.
)";
}  // namespace

std::string benchmark_summary(const BenchmarkReport& report) {
  std::vector<TableRow> rows{{"sequence", "runs"}};
  for (const auto& metric : benchmark_metrics()) rows.front().push_back(metric.title);
  for (const auto& sequence : report.sequences) {
    rows.push_back({table_cell(sequence.sequence.name), std::to_string(sequence.complete_runs().size())});
    for (const auto& metric : benchmark_metrics())
      rows.back().push_back(metric.cell(median_of(sequence, metric.of)));
  }
  return markdown_table(rows);
}

std::string benchmark_markdown(const BenchmarkReport& report) {
  std::ostringstream text;
  text << "# Static sequences\n\nRO-SLAM " << report.version << ", " << name_of(report.settings.mode) << ", "
       << report.runs << " runs per sequence, medians over the runs. Machine: " << report.processor << ", "
       << report.cores << " cores.\n";
  if (report.is_interrupted) text << "\n**Interrupted: sequences and runs are missing.**\n";
  text << "\n" << benchmark_summary(report) << kLegend;
  for (const auto& sequence : report.sequences) text << section_of(sequence);
  return text.str();
}

std::string benchmark_json(const BenchmarkReport& report) {
  Json json = head_json("static", report);
  json["sequences"] = Json::array();
  for (const auto& sequence : report.sequences) json["sequences"].push_back(json_of(sequence));
  return text_of(json);
}

}  // namespace roslam::app
