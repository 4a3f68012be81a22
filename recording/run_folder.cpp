// SPDX-License-Identifier: BSD-3-Clause
#include "recording/run_folder.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <exception>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "evaluation/trajectory_plot.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"

namespace roslam::recording {

using namespace evaluation;

using Path = std::filesystem::path;

enum class RunFolder::Result { kWritten, kRemoved, kKept };

// A file of the run folder and what happens to it.
struct RunFolder::Output {
  const char* file;
  std::function<void(const Path&)> write;
  Result result = Result::kWritten;
  bool is_essential = false;  // written however urgent the end of the run is
};

RunFolder::Result RunFolder::if_any(bool is_any, Result otherwise) {
  return is_any ? Result::kWritten : otherwise;
}

namespace {
// What a run writes.
constexpr std::array kResults{"run.json",       "trajectory.txt",  "keyframes.txt", "odometry.csv",
                              "map.ply",        "map.roslam",      "dense.ply",     "dense.bt",
                              "trajectory.png", "groundtruth.txt", "report.html",   "descriptors.jsonl",
                              "masks",          "removal.jpg",     "removal.avi",   "restoration.jpg"};
constexpr const char* kPrevious = "previous";
constexpr const char* kSessions = "sessions";

bool is_run(const Path& folder) {
  const auto json = nlohmann::json::parse(std::ifstream(folder / "run.json"), nullptr, false);
  return json.is_object() && json.contains("version") && json.contains("source");
}

// Time, process and the clock's finest digits: no two runs have the same.
std::string new_id() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y%m%dT%H%M%SZ", &utc);
  const auto nanoseconds = now.time_since_epoch().count() % 1000000000;
  return std::string(text.data()) + "-" + std::to_string(getpid()) + "-" + std::to_string(nanoseconds);
}

bool is_same(const Path& a, const Path& b) {
  std::error_code error;
  return !b.empty() && std::filesystem::equivalent(a, b, error);
}

// Where the results of a run that is resumed go.
Path next_session(const Path& folder) {
  std::error_code error;
  int number = 1;
  while (std::filesystem::exists(folder / kSessions / std::to_string(number), error)) ++number;
  return folder / kSessions / std::to_string(number);
}

// Moves the results of an earlier run to another folder, as a whole: what is there is of the run before and
// goes. An earlier run that was killed before it wrote any leaves nothing worth that. A device stays where it
// is.
void move_away(const Path& folder, const Path& previous, const Path& kept) {
  std::error_code error;
  const std::set<std::string> unfinished{"run.json", "descriptors.jsonl", "masks"};  // of no use alone
  const bool has_results = std::any_of(kResults.begin(), kResults.end(), [&](const char* name) {
    return unfinished.count(name) == 0 && is_file_or_folder(folder / name);
  });
  if (has_results) make_folder(previous);
  for (const char* name : kResults) {
    if (is_same(folder / name, kept)) continue;
    if (has_results) std::filesystem::remove_all(previous / name, error);
    error.clear();
    if (!is_file_or_folder(folder / name)) continue;
    if (has_results) {
      std::filesystem::rename(folder / name, previous / name, error);
    } else {
      std::filesystem::remove_all(folder / name, error);
    }
    if (error) {
      throw OutputError((folder / name).string() +
                        ": left by an earlier run and cannot be moved away; choose another --out");
    }
  }
}

// The result of an earlier run must not be taken for one of this run.
void remove_old(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error)
    throw OutputError(file.string() + ": left by an earlier run and cannot be removed; choose another --out");
}

}  // namespace

void RunFolder::write_one(const Output& output, const std::filesystem::path& file) {
  try {
    if (output.result == Result::kWritten) output.write(file);
    if (output.result == Result::kRemoved) remove_old(file);
  } catch (const OutputError&) {
    throw;
  } catch (const std::exception& error) {
    throw OutputError(file.string() + ": cannot be written: " + error.what());
  }
}

RunFolder::RunFolder(const std::filesystem::path& path, bool overwrite) : path_(path), lock_(path) {
  std::error_code error;
  if (std::filesystem::exists(path / "rgb.txt", error)) {
    throw OutputError(path.string() +
                      ": is a dataset, whose ground truth the results could overwrite; choose another --out");
  }
  const bool may_replace = overwrite || is_run(path);
  for (const char* name : kResults) {
    if (may_replace || !is_file_or_folder(path / name)) continue;
    throw OutputError(
        path.string() + ": holds " + name +
        ", which roslam run did not write; choose another --out, or replace it with --overwrite");
  }
  // Results of an earlier run stay until this one begins.
  const auto probe = path / ".roslam_probe";
  write_file(probe, "\n");
  std::filesystem::remove(probe, error);
}

void RunFolder::begin(RunDescription& description, const Camera& camera) const {
  for (const char* name : kResults) {
    if (is_same(path_ / kPrevious / name, description.map))
      throw OutputError(description.map + ": would be replaced by the results in " + path_.string() +
                        "; copy it or choose another --out");
  }
  move_away(path_, description.resumes ? next_session(path_) : path_ / kPrevious, description.map);
  description.id = new_id();
  write_file(path_ / "run.json", unfinished_report(description, camera));
}

std::map<std::string, std::size_t> rejected_by_reason(const Slam& slam) {
  std::map<std::string, std::size_t> result;
  for (const auto& [reason, count] : slam.rejected()) result[std::string(describe(reason))] += count;
  return result;
}

void RunFolder::write_flight(const Slam& slam) const {
  const bool has_new_map = slam.options().keyframes.enabled && slam.map().keyframe_count() > 0;
  write_all({
      {"trajectory.txt", [&](const Path& file) { write_trajectory(file, slam.trajectory()); }},
      {"keyframes.txt", [&](const Path& file) { write_trajectory(file, slam.keyframes()); }},
      // Kept if there is no new map: it may be the map that was loaded.
      {"map.roslam", [&](const Path& file) { save_map(file, slam.saved_map()); },
       if_any(has_new_map, Result::kKept)},
  });
}

void RunFolder::write(const Slam& slam, const RunResults& summary, const FrameSource& source,
                      const RunDescription& description, const std::function<bool()>& is_urgent) const {
  const Trajectory trajectory = slam.trajectory();
  const bool has_occupancy = summary.dense && summary.dense->occupancy;
  write_all(
      {
          {"run.json",
           [&](const Path& file) { write_file(file, run_report(slam, summary, source, description)); },
           Result::kWritten, true},
          {"groundtruth.txt", [&](const Path& file) { write_trajectory(file, summary.truth); },
           if_any(!summary.truth.empty(), Result::kRemoved), true},
          {"trajectory.png",
           [&](const Path& file) { write_png(file, plot_trajectory(trajectory, "RO-SLAM", WorldUp::kZ)); },
           if_any(!trajectory.empty(), Result::kRemoved)},
          {"map.ply", [&](const Path& file) { write_map_ply(file, slam.map(), slam.main_submap()); }},
          {"dense.ply", [&](const Path& file) { write_surface_ply(file, summary.dense->surface, true); },
           if_any(summary.dense.has_value(), Result::kRemoved)},
          {"dense.bt", [&](const Path& file) { summary.dense->occupancy->write(file); },
           if_any(has_occupancy, Result::kRemoved)},
          {"report.html",
           [&](const Path& file) {
             replace_file(file, run_page(slam, summary, source, description, path_));
           }},
      },
      is_urgent);
}

void RunFolder::write_all(const std::vector<Output>& outputs, const std::function<bool()>& is_urgent) const {
  std::exception_ptr first_failure;
  for (const auto& output : outputs) {
    if (!output.is_essential && is_urgent && is_urgent()) continue;
    try {
      write_one(output, path_ / output.file);
    } catch (const OutputError&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

}  // namespace roslam::recording
