// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/run_folder.hpp"

#include <exception>
#include <functional>
#include <vector>

#include "roslam/error.hpp"
#include "roslam/evaluation/trajectory_plot.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/write_file.hpp"

namespace roslam {

namespace {
struct Result {
  const char* file;
  std::function<void(const std::filesystem::path&)> write;
  bool is_there = true;  // false: this run has no such result
};

// The result of an earlier run must not pass for one of this run.
void remove_old(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error)
    throw OutputError(file.string() + ": left by an earlier run and cannot be removed; choose another --out");
}

void write_one(const Result& result, const std::filesystem::path& file) {
  try {
    result.is_there ? result.write(file) : remove_old(file);
  } catch (const OutputError&) {
    throw;
  } catch (const std::exception& error) {
    throw OutputError(file.string() + ": cannot be written: " + error.what());
  }
}
}  // namespace

RunFolder::RunFolder(const std::filesystem::path& path) : path_(path) {
  make_folder(path);
  std::error_code error;
  if (std::filesystem::exists(path / "rgb.txt", error)) {
    throw OutputError(path.string() +
                      ": is a dataset, whose ground truth results could replace; choose another --out");
  }
  const auto probe = path / "run.json";
  write_file(probe, "{}\n");
}

void RunFolder::write(const Slam& slam, const RunSummary& summary, const FrameSource& source,
                      const RunDescription& description) const {
  using Path = std::filesystem::path;
  const Trajectory trajectory = slam.trajectory();
  const std::vector<Result> results{
      {"trajectory.txt", [&](const Path& file) { write_trajectory(file, trajectory); }},
      {"keyframes.txt", [&](const Path& file) { write_trajectory(file, slam.keyframes()); }},
      {"run.json",
       [&](const Path& file) { write_file(file, run_report(slam, summary, source, description)); }},
      {"groundtruth.txt", [&](const Path& file) { write_trajectory(file, summary.truth); },
       !summary.truth.empty()},
      {"trajectory.png",
       [&](const Path& file) { write_png(file, plot_trajectory(trajectory, "RO-SLAM", WorldUp::kZ)); },
       !trajectory.empty()},
      {"map.ply", [&](const Path& file) { write_map_ply(file, slam.map()); }},
  };
  std::exception_ptr first_failure;
  for (const auto& result : results) {
    try {
      write_one(result, path_ / result.file);
    } catch (const OutputError&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

}  // namespace roslam
