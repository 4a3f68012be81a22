// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/dynamic/dynamic_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "apps/roslam/benchmark/benchmark_metrics.hpp"
#include "apps/roslam/benchmark/dynamic/paper_tables.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/statistics.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kPercent = 100.0;

using Results = std::vector<BenchmarkedSequence>;

constexpr auto kLegend = R"(
- ATE: absolute trajectory error after SE(3) alignment of the whole trajectory, RMSE. A share of tracked
  frames is given only where it is below 100 %; such an error has neither bar nor ratio.
- static counterpart: the simulated flight without traffic, the recording that a composed sequence was
  composed from, or the folder of --counterparts.
- none, labels, geometry, both: how dynamic objects are detected: not at all, by the segmentation network, by
  depth and optical flow, by all of them. ds-slam-like (labelled objects are removed unless optical flow finds
  them at rest, unlabelled ones where it finds motion) and dynaslam-like (all labelled objects are removed,
  and points that contradict the depth of earlier images) combine parts of RO-SLAM, with its network, in the
  manner of those systems; they are not those systems.
- paper: tables 3 and 5 as published, medians and means of ten runs, measured on another computer with a GPU.
)";

constexpr auto kTimesLegend = R"(
Processor time, medians over runs and sequences. Tracking is the time from an image to its pose, the latency
of a frame; the network has a thread of its own and in real time labels as many frames as it can. The paper
gives the time of a whole frame, including the network, on a GPU.
)";
constexpr auto kRemovalLegend = R"(
Actors are the objects that move according to the truth; "actors cover" is their share of the image. The
others are shares of the ORB points: on actors and kept; on the static scene and removed, in all, within 10
pixels of an actor's silhouette, and beyond. Of each mode's first run.
)";

// An error over a part of the frames is marked: lost frames would look like accuracy.
std::string error_cell(const Results& results, std::size_t mode) {
  if (mode >= results.size()) return "-";
  const BenchmarkedSequence& sequence = results[mode];
  std::string error = fixed(ate_in(results, mode), 4);
  const double tracked = median_of(sequence, tracked_share_of);
  if (std::isfinite(tracked) && tracked < kAllTracked)
    error += " (" + fixed(kPercent * tracked, 1) + " % tracked)";
  const std::size_t complete = sequence.complete_runs().size();
  if (complete < sequence.runs.size())
    error += " (" + std::to_string(complete) + " of " + std::to_string(sequence.runs.size()) + " runs)";
  return error;
}

const PaperError* published(const std::vector<PaperError>& table, const BenchmarkSequence& sequence) {
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&](const PaperError& row) { return sequence.name == tum_folder_of(row); });
  return found == table.end() ? nullptr : &*found;
}

std::string table_of_errors(const DynamicReport& report) {
  const auto paper = paper_table_3();
  const bool has_published = std::any_of(report.results.begin(), report.results.end(), [&](const auto& r) {
    return published(paper, r.sequence) != nullptr;
  });
  std::vector<TableRow> rows{{"ATE RMSE, m"}};
  for (const auto& mode : report.modes) rows.front().push_back(title_of_mode(mode));
  if (has_published) {
    for (const char* system : {"ORB-SLAM2", "DS-SLAM", "DynaSLAM", "RO-SLAM"})
      rows.front().push_back(std::string("paper: ") + system);
  }
  for (const auto& result : report.results) {
    rows.push_back({table_cell(result.sequence.name)});
    for (std::size_t i = 0; i < report.modes.size(); ++i)
      rows.back().push_back(error_cell(result.by_mode, i));
    if (const PaperError* row = published(paper, result.sequence)) {
      for (const double value : {row->orb_slam2, row->ds_slam, row->dynaslam, row->ro_slam})
        rows.back().push_back(fixed(value, 4));
    }
    if (!result.has_counterpart) continue;
    rows.push_back({"- static counterpart"});
    for (std::size_t i = 0; i < report.modes.size(); ++i)
      rows.back().push_back(error_cell(result.counterpart_by_mode, i));
  }
  return markdown_table(rows);
}

// Error of each mode divided by that of the static counterpart in mode none.
std::string table_of_ratios(const DynamicReport& report) {
  const auto none = std::find(report.modes.begin(), report.modes.end(), "none");
  if (none == report.modes.end()) return "";
  std::vector<TableRow> rows{{"ratio of ATE"}};
  for (const auto& mode : report.modes) rows.front().push_back(title_of_mode(mode));
  for (const auto& result : report.results) {
    const double base =
        whole_ate_in(result.counterpart_by_mode, static_cast<std::size_t>(none - report.modes.begin()));
    if (!std::isfinite(base)) continue;
    const auto add = [&](const std::string& name, const Results& results) {
      rows.push_back({name});
      for (std::size_t i = 0; i < report.modes.size(); ++i)
        rows.back().push_back(fixed(whole_ate_in(results, i) / base, 2));
    };
    add(table_cell(result.sequence.name), result.by_mode);
    add("- static counterpart", result.counterpart_by_mode);
  }
  if (rows.size() == 1) return "";
  return "\n## Relative to the static counterpart without removal\n\n" + markdown_table(rows);
}

std::string table_of_removal(const DynamicReport& report) {
  std::vector<TableRow> rows{{"% of ORB points", "mode", "actors cover", "on actors, kept", "static, removed",
                              "within 10 px", "beyond"}};
  for (const auto& result : report.results) {
    for (std::size_t i = 0; i < result.removal.size(); ++i) {
      if (!result.removal[i]) continue;
      const RemovalError& error = *result.removal[i];
      rows.push_back({table_cell(result.sequence.name), report.modes[i]});
      for (const double share :
           {error.actor_share(), error.on_actors.kept_share(), error.on_static_scene().removed_share(),
            error.near_actors.removed_share(), error.beyond.removed_share()})
        rows.back().push_back(fixed(kPercent * share, 1));
    }
  }
  if (rows.size() == 1) return "";
  return "\n## Removed points, where the truth is known\n\n" + markdown_table(rows) + kRemovalLegend;
}

double over_sequences(const DynamicReport& report, std::size_t mode,
                      const std::function<double(const BenchmarkedSequence&)>& value) {
  std::vector<double> values;
  for (const auto& result : report.results) {
    if (mode >= result.by_mode.size()) continue;
    if (const double one = value(result.by_mode[mode]); std::isfinite(one)) values.push_back(one);
  }
  return median(std::move(values));
}

std::string table_of_times(const DynamicReport& report) {
  std::vector<TableRow> rows{{"ms", "whole frame", "tracking mean", "median", "p95",
                              "network, per labelled image", "dropped frames"}};
  for (std::size_t i = 0; i < report.modes.size(); ++i) {
    const auto stage = [&](const char* name, double StageSummary::*value) {
      return fixed(over_sequences(report, i, [&](const auto& s) { return stage_median(s, name, value); }), 1);
    };
    rows.push_back({title_of_mode(report.modes[i]), "-", stage("tracking", &StageSummary::mean_ms),
                    stage("tracking", &StageSummary::median_ms), stage("tracking", &StageSummary::p95_ms),
                    stage("segmentation", &StageSummary::mean_ms),
                    fixed(over_sequences(report, i,
                                         [](const auto& s) {
                                           return median_of(s, [](const auto& run) { return run.dropped; });
                                         }),
                          0)});
  }
  for (const auto& [method, milliseconds] : paper_table_5())
    rows.push_back({"paper: " + method, fixed(milliseconds, 2), "-", "-", "-", "-", "-"});
  return markdown_table(rows);
}

std::string remarks_of(const DynamicReport& report) {
  std::ostringstream text;
  const auto remark = [&](const BenchmarkedSequence& sequence, const std::string& mode) {
    for (std::size_t i = 0; i < sequence.runs.size(); ++i) {
      const BenchmarkRun& run = sequence.runs[i];
      std::string what;
      if (run.is_interrupted)
        what = "was interrupted";
      else if (!run.failure.empty())
        what = "failed: " + run.failure;
      else if (!run.error)
        what = "has no accuracy: " + run.no_error_reason;
      if (!what.empty())
        text << "\n" << sequence.sequence.name << ", " << mode << ": run " << i + 1 << " " << what << ".\n";
    }
    if (sequence.repeats && !*sequence.repeats && report.settings.mode == Mode::kDeterministic)
      text << "\n" << sequence.sequence.name << ", " << mode << ": the runs differ.\n";
  };
  for (const auto& result : report.results) {
    for (std::size_t i = 0; i < result.by_mode.size(); ++i) remark(result.by_mode[i], report.modes[i]);
    for (std::size_t i = 0; i < result.counterpart_by_mode.size(); ++i)
      remark(result.counterpart_by_mode[i], report.modes[i]);
  }
  return text.str();
}

}  // namespace

std::string dynamic_summary(const DynamicReport& report) { return table_of_errors(report); }

std::string dynamic_markdown(const DynamicReport& report) {
  std::ostringstream text;
  text << "# Dynamic sequences\n\nRO-SLAM " << report.version << ", " << name_of(report.settings.mode) << ", "
       << report.runs
       << " runs of each sequence in each mode, medians over the runs. Machine: " << report.processor << ", "
       << report.cores << " cores.\n";
  if (report.is_interrupted) text << "\n**Interrupted: sequences and runs are missing.**\n";
  text << "\n## Absolute trajectory error (table 3 of the paper)\n\n" << table_of_errors(report) << kLegend;
  if (!report.bars.empty()) text << "\n![Errors by mode](" << report.bars << ")\n";
  text << table_of_ratios(report) << table_of_removal(report);
  text << "\n## Processor time (table 5 of the paper)\n\n" << table_of_times(report) << kTimesLegend;
  if (const std::string remarks = remarks_of(report); !remarks.empty()) text << "\n## Remarks\n" << remarks;
  for (const auto& result : report.results) {
    if (result.figure.empty()) continue;
    text << "\n## " << result.sequence.name << "\n\n![Trajectories of " << result.sequence.name << "]("
         << result.figure << ")\n";
  }
  return text.str();
}

}  // namespace roslam::app
