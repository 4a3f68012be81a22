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

RunFolder::RunFolder(const std::filesystem::path& path) : path_(path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path)) {
    throw OutputError(path.string() + ": cannot create the output folder; choose another --out");
  }
  const auto probe = path / "run.json";
  write_file(probe, "{}\n");
}

void RunFolder::write(const Slam& slam, const RunSummary& summary, const FrameSource& source,
                      const RunDescription& description) const {
  const std::vector<std::function<void()>> writers{
      [&] { write_file(path_ / "run.json", run_report(slam, summary, source, description)); },
      [&] { write_trajectory(path_ / "trajectory.txt", slam.trajectory()); },
      [&] { write_trajectory(path_ / "keyframes.txt", slam.keyframes()); },
      [&] {
        if (!summary.truth.empty()) write_trajectory(path_ / "groundtruth.txt", summary.truth);
      },
      [&] {
        const Trajectory trajectory = slam.trajectory();
        if (!trajectory.empty()) write_png(path_ / "trajectory.png", plot_trajectory(trajectory, "RO-SLAM", WorldUp::kZ));
      },
      [&] { write_map_ply(path_ / "map.ply", slam.map()); },
  };
  std::exception_ptr first_failure;
  for (const auto& write_one : writers) {
    try {
      write_one();
    } catch (const OutputError&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

}  // namespace roslam
