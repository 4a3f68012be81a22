// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_metrics.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/statistics.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
using Json = nlohmann::ordered_json;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double error_or_unknown(const BenchmarkRun& run, const std::function<double(const TrajectoryError&)>& value) {
  return run.error ? value(*run.error) : kUnknown;
}

double tracking_time(const BenchmarkRun& run, double StageSummary::*value) {
  const auto found = run.stages.find("tracking");
  return found == run.stages.end() ? kUnknown : found->second.*value;
}

Json json_of(const BenchmarkRun& run) {
  Json json{{"folder", run.folder}, {"interrupted", run.is_interrupted}};
  json["failure"] = run.failure.empty() ? Json(nullptr) : Json(run.failure);
  if (!run.failure.empty()) return json;
  for (const auto& metric : benchmark_metrics()) json[metric.key] = json_number(metric.of(run));
  json["frames_per_second"] = json_number(run.frames_per_second);
  json["no_accuracy_because"] = run.error ? Json(nullptr) : Json(run.no_error_reason);
  return json;
}

}  // namespace

std::string Metric::cell(double value) const {
  constexpr double kPercent = 100.0;
  return fixed(key.ends_with("_share") ? kPercent * value : value, decimals);
}

double ate_of(const BenchmarkRun& run) { return run.error ? run.error->ate.rmse : kUnknown; }

double tracked_share_of(const BenchmarkRun& run) {
  return run.frames > 0.0 ? run.tracked / run.frames : kUnknown;
}

std::vector<Metric> benchmark_metrics() {
  const auto error = [](auto value) {
    return [value](const BenchmarkRun& r) { return error_or_unknown(r, value); };
  };
  return {
      {"frames", "frames", 0, [](const auto& r) { return r.frames; }},
      {"tracked_share", "tracked %", 1, tracked_share_of},
      {"wrong_frames", "wrong frames", 0,
       error([](const TrajectoryError& e) { return static_cast<double>(e.wrong_frames.size()); })},
      {"dropped", "dropped", 0, [](const auto& r) { return r.dropped; }},
      {"ate_rmse_m", "ATE RMSE m", 4, ate_of},
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

nlohmann::ordered_json json_number(double value) {
  if (value == std::trunc(value) && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
  return number(value);
}

nlohmann::ordered_json json_of(const BenchmarkedSequence& sequence) {
  Json json{{"name", sequence.sequence.name}, {"source", sequence.sequence.source}};
  json["camera"] = sequence.sequence.camera.empty() ? Json(nullptr) : Json(sequence.sequence.camera);
  json["complete_runs"] = sequence.complete_runs().size();
  json["repeats"] = sequence.repeats ? Json(*sequence.repeats) : Json(nullptr);
  json["figure"] = sequence.figure.empty() ? Json(nullptr) : Json(sequence.figure);
  for (const auto& metric : benchmark_metrics())
    json["median"][metric.key] = json_number(median_of(sequence, metric.of));
  json["stages"] = Json::object();
  for (const auto& stage : stages_of(sequence)) {
    json["stages"][stage] = {
        {"count", json_number(stage_count(sequence, stage))},
        {"mean_ms", json_number(stage_median(sequence, stage, &StageSummary::mean_ms))},
        {"median_ms", json_number(stage_median(sequence, stage, &StageSummary::median_ms))},
        {"p95_ms", json_number(stage_median(sequence, stage, &StageSummary::p95_ms))},
        {"max_ms", json_number(stage_median(sequence, stage, &StageSummary::max_ms))}};
  }
  json["runs"] = Json::array();
  for (const auto& run : sequence.runs) json["runs"].push_back(json_of(run));
  return json;
}

nlohmann::ordered_json head_json(const std::string& benchmark, const BenchmarkHeader& header) {
  const BenchmarkSettings& settings = header.settings;
  Json json{{"benchmark", benchmark},
            {"version", header.version},
            {"machine", {{"processor", header.processor}, {"cores", header.cores}}},
            {"mode", name_of(settings.mode)},
            {"runs", header.runs},
            {"interrupted", header.is_interrupted},
            {"simulation",
             {{"traffic", settings.traffic},
              {"frames", settings.frames},
              {"seed", settings.seed},
              {"stereo", settings.stereo}}}};
  json["config"] = settings.config.empty() ? Json(nullptr) : Json(settings.config);
  return json;
}

std::string text_of(const nlohmann::ordered_json& report) {
  return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

const char* name_of(Mode mode) { return mode == Mode::kDeterministic ? "deterministic" : "real-time"; }

}  // namespace roslam::app
