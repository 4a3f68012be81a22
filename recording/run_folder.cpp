// SPDX-License-Identifier: BSD-3-Clause
#include "recording/run_folder.hpp"

#include <exception>
#include <functional>
#include <vector>

#include "evaluation/trajectory_plot.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/occupancy_map.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/map_io/map_file.hpp"

namespace roslam::recording {

using namespace evaluation;

using Path = std::filesystem::path;

enum class RunFolder::Result { kWritten, kRemoved, kKept };

// A file of the run folder and what happens to it.
struct RunFolder::Output {
  const char* file;
  std::function<void(const Path&)> write;
  Result result = Result::kWritten;
};

RunFolder::Result RunFolder::if_any(bool is_any, Result otherwise) {
  return is_any ? Result::kWritten : otherwise;
}

namespace {
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

RunFolder::RunFolder(const std::filesystem::path& path) : path_(path) {
  make_folder(path);
  std::error_code error;
  if (std::filesystem::exists(path / "rgb.txt", error)) {
    throw OutputError(path.string() +
                      ": is a dataset, whose ground truth the results could overwrite; choose another --out");
  }
  // Results of an earlier run stay until there are new ones.
  const auto probe = path / ".roslam_probe";
  write_file(probe, "\n");
  std::filesystem::remove(probe, error);
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
      {"map.roslam", [&](const Path& file) { save_map(file, slam.snapshot()); },
       if_any(has_new_map, Result::kKept)},
  });
}

void RunFolder::write(const Slam& slam, const RunResults& summary, const FrameSource& source,
                      const RunDescription& description) const {
  const Trajectory trajectory = slam.trajectory();
  const bool has_occupancy = summary.dense && summary.dense->occupancy;
  write_all({
      {"run.json",
       [&](const Path& file) { write_file(file, run_report(slam, summary, source, description)); }},
      {"groundtruth.txt", [&](const Path& file) { write_trajectory(file, summary.truth); },
       if_any(!summary.truth.empty(), Result::kRemoved)},
      {"trajectory.png",
       [&](const Path& file) { write_png(file, plot_trajectory(trajectory, "RO-SLAM", WorldUp::kZ)); },
       if_any(!trajectory.empty(), Result::kRemoved)},
      {"map.ply", [&](const Path& file) { write_map_ply(file, slam.map(), slam.main_submap()); }},
      {"dense.ply", [&](const Path& file) { write_surface_ply(file, summary.dense->surface, true); },
       if_any(summary.dense.has_value(), Result::kRemoved)},
      {"dense.bt", [&](const Path& file) { summary.dense->occupancy->write(file); },
       if_any(has_occupancy, Result::kRemoved)},
      {"report.html",
       [&](const Path& file) { replace_file(file, run_page(slam, summary, description, path_)); }},
  });
}

void RunFolder::write_all(const std::vector<Output>& outputs) const {
  std::exception_ptr first_failure;
  for (const auto& output : outputs) {
    try {
      write_one(output, path_ / output.file);
    } catch (const OutputError&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

}  // namespace roslam::recording
