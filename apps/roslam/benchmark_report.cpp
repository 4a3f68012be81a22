// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark_report.hpp"

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "roslam/evaluation/markdown_table.hpp"
#include "roslam/evaluation/statistics.hpp"

namespace roslam::app {

namespace {
using Json = nlohmann::ordered_json;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// One number of a run: its key in JSON, its column in Markdown.
struct Metric {
  std::string key;
  std::string title;
  int decimals;
  std::function<double(const BenchmarkRun&)> of;
};

double error_or_unknown(const BenchmarkRun& run, const std::function<double(const TrajectoryError&)>& value) {
  return run.error ? value(*run.error) : kUnknown;
}

double tracking_time(const BenchmarkRun& run, double StageSummary::*value) {
  const auto found = run.stages.find("tracking");
  return found == run.stages.end() ? kUnknown : found->second.*value;
}

std::vector<Metric> metrics() {
  const auto error = [](auto value) {
    return [value](const BenchmarkRun& r) { return error_or_unknown(r, value); };
  };
  return {
      {"frames", "frames", 0, [](const auto& r) { return r.frames; }},
      {"tracked_share", "tracked %", 1,
       [](const auto& r) { return r.frames > 0.0 ? r.tracked / r.frames : kUnknown; }},
      {"dropped", "dropped", 0, [](const auto& r) { return r.dropped; }},
      {"ate_rmse_m", "ATE RMSE m", 4, error([](const TrajectoryError& e) { return e.ate.rmse; })},
      {"rpe_frame_rmse_m", "RPE frame m", 4,
       error([](const TrajectoryError& e) { return e.rpe_frame.translation.rmse; })},
      {"rpe_second_rmse_m", "RPE 1 s m", 4,
       error([](const TrajectoryError& e) { return e.rpe_span.translation.rmse; })},
      {"rpe_second_rmse_deg", "RPE 1 s deg", 3,
       error([](const TrajectoryError& e) { return e.rpe_span.rotation.rmse; })},
      {"tracking_median_ms", "tracking ms", 1,
       [](const auto& r) { return tracking_time(r, &StageSummary::median_ms); }},
      {"tracking_p95_ms", "p95 ms", 1, [](const auto& r) { return tracking_time(r, &StageSummary::p95_ms); }},
      {"keyframes", "keyframes", 0, [](const auto& r) { return r.keyframes; }},
      {"landmarks", "landmarks", 0, [](const auto& r) { return r.landmarks; }},
      {"peak_memory_mb", "memory MB", 0, [](const auto& r) { return r.peak_memory_megabytes; }},
      {"start_up_s", "start-up s", 2, [](const auto& r) { return r.start_up_seconds; }},
  };
}

std::string cell(const Metric& metric, double value) {
  constexpr double kPercent = 100.0;
  return fixed(metric.key == "tracked_share" ? kPercent * value : value, metric.decimals);
}

double median_of(const BenchmarkedSequence& sequence,
                 const std::function<double(const BenchmarkRun&)>& value) {
  std::vector<double> values;
  for (const auto* run : sequence.complete_runs()) {
    if (const double one = value(*run); std::isfinite(one)) values.push_back(one);
  }
  return median(std::move(values));
}

std::set<std::string> stages_of(const BenchmarkedSequence& sequence) {
  std::set<std::string> names;
  for (const auto* run : sequence.complete_runs()) {
    for (const auto& [name, summary] : run->stages) names.insert(name);
  }
  return names;
}

double stage_median(const BenchmarkedSequence& sequence, const std::string& stage,
                    double StageSummary::*value) {
  return median_of(sequence, [&](const BenchmarkRun& run) {
    const auto found = run.stages.find(stage);
    return found == run.stages.end() ? kUnknown : found->second.*value;
  });
}

double stage_count(const BenchmarkedSequence& sequence, const std::string& stage) {
  return median_of(sequence, [&](const BenchmarkRun& run) {
    const auto found = run.stages.find(stage);
    return found == run.stages.end() ? kUnknown : static_cast<double>(found->second.count);
  });
}

std::string table_of_runs(const BenchmarkedSequence& sequence) {
  std::vector<TableRow> rows{{"run"}};
  for (const auto& metric : metrics()) rows.front().push_back(metric.title);
  std::ostringstream remarks;
  for (std::size_t i = 0; i < sequence.runs.size(); ++i) {
    const BenchmarkRun& run = sequence.runs[i];
    const std::string number = std::to_string(i + 1);
    if (run.is_complete()) {
      rows.push_back({number});
      for (const auto& metric : metrics()) rows.back().push_back(cell(metric, metric.of(run)));
      if (!run.error) remarks << "\nRun " << number << " has no accuracy: " << run.no_error_reason << ".\n";
    } else {
      const std::string what = run.is_interrupted ? "was interrupted" : "failed: " + run.failure;
      remarks << "\nRun " << number << " " << what << ".\n";
    }
  }
  if (rows.size() > 2) {
    rows.push_back({"median"});
    for (const auto& metric : metrics()) rows.back().push_back(cell(metric, median_of(sequence, metric.of)));
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

// Counts without a point, what is not known as null.
Json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  if (value == std::trunc(value) && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
  return value;
}

Json json_of(const BenchmarkRun& run) {
  Json json{{"folder", run.folder}, {"interrupted", run.is_interrupted}};
  json["failure"] = run.failure.empty() ? Json(nullptr) : Json(run.failure);
  if (!run.failure.empty()) return json;
  for (const auto& metric : metrics()) json[metric.key] = number(metric.of(run));
  json["frames_per_second"] = number(run.frames_per_second);
  json["no_accuracy_because"] = run.error ? Json(nullptr) : Json(run.no_error_reason);
  return json;
}

Json json_of(const BenchmarkedSequence& sequence) {
  Json json{{"name", sequence.sequence.name}, {"source", sequence.sequence.source}};
  json["camera"] = sequence.sequence.camera.empty() ? Json(nullptr) : Json(sequence.sequence.camera);
  json["complete_runs"] = sequence.complete_runs().size();
  json["repeats"] = sequence.repeats ? Json(*sequence.repeats) : Json(nullptr);
  json["figure"] = sequence.figure.empty() ? Json(nullptr) : Json(sequence.figure);
  for (const auto& metric : metrics()) json["median"][metric.key] = number(median_of(sequence, metric.of));
  json["stages"] = Json::object();
  for (const auto& stage : stages_of(sequence)) {
    json["stages"][stage] = {{"count", number(stage_count(sequence, stage))},
                             {"median_ms", number(stage_median(sequence, stage, &StageSummary::median_ms))},
                             {"p95_ms", number(stage_median(sequence, stage, &StageSummary::p95_ms))},
                             {"max_ms", number(stage_median(sequence, stage, &StageSummary::max_ms))}};
  }
  json["runs"] = Json::array();
  for (const auto& run : sequence.runs) json["runs"].push_back(json_of(run));
  return json;
}

const char* name_of(Mode mode) { return mode == Mode::kDeterministic ? "deterministic" : "real-time"; }

constexpr auto kLegend = R"(
- tracked: share of the sequence's frames that got a pose; dropped: frames that came while the tracker was busy.
- ATE: distance from the truth after the best rigid alignment, SE(3), of the whole path; RPE: error of the motion
  from frame to frame and over one second; root mean squares.
- tracking, p95: median and 95th percentile of the processor time of the tracking thread for a frame, from the
  picture to its pose; reading the picture is not part of it.
- memory: the most a run's process held; start-up: from the start of the process to the first pose. Of a simulated
  flight both include the simulation.
)";
}  // namespace

std::vector<const BenchmarkRun*> BenchmarkedSequence::complete_runs() const {
  std::vector<const BenchmarkRun*> complete;
  for (const auto& run : runs) {
    if (run.is_complete()) complete.push_back(&run);
  }
  return complete;
}

std::string processor_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(':');
    if (line.starts_with("model name") && colon != std::string::npos && colon + 2 < line.size()) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

std::string benchmark_summary(const BenchmarkReport& report) {
  std::vector<TableRow> rows{{"sequence", "runs"}};
  for (const auto& metric : metrics()) rows.front().push_back(metric.title);
  for (const auto& sequence : report.sequences) {
    rows.push_back({table_cell(sequence.sequence.name), std::to_string(sequence.complete_runs().size())});
    for (const auto& metric : metrics()) rows.back().push_back(cell(metric, median_of(sequence, metric.of)));
  }
  return markdown_table(rows);
}

std::string benchmark_markdown(const BenchmarkReport& report) {
  std::ostringstream text;
  text << "# Where nothing moves\n\nRO-SLAM " << report.version << ", " << name_of(report.settings.mode)
       << ", " << report.runs << " runs a sequence, medians over the runs. Machine: " << report.processor
       << ", " << report.cores << " cores.\n";
  if (report.is_interrupted) text << "\n**Interrupted: sequences and runs are missing.**\n";
  text << "\n" << benchmark_summary(report) << kLegend;
  for (const auto& sequence : report.sequences) text << section_of(sequence);
  return text.str();
}

std::string benchmark_json(const BenchmarkReport& report) {
  const BenchmarkSettings& settings = report.settings;
  Json json{
      {"benchmark", "static"},
      {"version", report.version},
      {"machine", {{"processor", report.processor}, {"cores", report.cores}}},
      {"mode", name_of(settings.mode)},
      {"runs", report.runs},
      {"interrupted", report.is_interrupted},
      {"simulation", {{"traffic", settings.traffic}, {"frames", settings.frames}, {"seed", settings.seed}}}};
  json["config"] = settings.config.empty() ? Json(nullptr) : Json(settings.config);
  json["sequences"] = Json::array();
  for (const auto& sequence : report.sequences) json["sequences"].push_back(json_of(sequence));
  // Names of files may hold any byte; one that is not UTF-8 shall not cost the report.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::app
