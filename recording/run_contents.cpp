// SPDX-License-Identifier: BSD-3-Clause
#include "recording/run_contents.hpp"

#include <algorithm>
#include <fstream>
#include <map>

#include "evaluation/association.hpp"
#include "recording/odometry_file.hpp"
#include "recording/removal_record.hpp"
#include "roslam/common/error.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/alignment.hpp"
#include "roslam/map_io/map_file.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;

bool is_there(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

// Whether a trajectory has a line with a pose: a run that ends before its first has none.
bool has_lines(const fs::path& file) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (!line.empty() && line.front() != '#') return true;
  return false;
}

Trajectory trajectory_if_any(const fs::path& file, RunContents& run) {
  if (is_there(file) && has_lines(file)) return read_trajectory(file).trajectory;
  run.notes.push_back(file.string() + ": " + (is_there(file) ? "holds no pose" : "no such file"));
  return {};
}

// Points of a map, of too many as many as there may be.
class PointSelection {
 public:
  PointSelection(std::size_t all, std::size_t most) : all_(all), kept_(std::min(all, most)) {}

  std::size_t kept() const { return kept_; }
  std::size_t index(std::size_t k) const { return k * all_ / std::max<std::size_t>(kept_, 1); }

  void note(const fs::path& file, RunContents& run) const {
    if (kept_ < all_)
      run.notes.push_back(file.string() + ": " + std::to_string(kept_) + " of its " + std::to_string(all_) +
                          " points are exported");
  }

 private:
  std::size_t all_, kept_;
};

std::vector<ColouredPoint> points_of_ply(const fs::path& file, std::size_t most, RunContents& run) {
  const SurfaceMap surface = read_surface_ply(file);
  const PointSelection selection(surface.points.size(), most);
  selection.note(file, run);
  std::vector<ColouredPoint> points(selection.kept());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const SurfacePoint& point = surface.points[selection.index(k)];
    points[k] = {point.position, point.colour};
  }
  return points;
}

// The landmarks of the submap with most of them.
std::vector<ColouredPoint> points_of_map(const fs::path& file, std::size_t most, RunContents& run) {
  const SavedMap saved = load_map(file);
  std::map<SubmapId, std::vector<LandmarkId>> submaps;
  for (const LandmarkId id : saved.map.landmark_ids())
    submaps[saved.map.submap_of(*saved.map.find(id))].push_back(id);
  if (submaps.empty()) return {};
  const auto largest = std::max_element(submaps.begin(), submaps.end(), [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  });
  const PointSelection selection(largest->second.size(), most);
  selection.note(file, run);
  std::vector<ColouredPoint> points(selection.kept());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Landmark& landmark = *saved.map.find(largest->second[selection.index(k)]);
    points[k] = {landmark.position.cast<float>(), landmark.colour};
  }
  return points;
}

std::vector<ColouredPoint> landmarks_of(const fs::path& folder, std::size_t most, RunContents& run) {
  if (is_there(folder / "map.ply")) return points_of_ply(folder / "map.ply", most, run);
  if (is_there(folder / "map.roslam")) {  // of a run that was killed after a checkpoint
    run.notes.push_back((folder / "map.ply").string() + ": no such file; landmarks are those of map.roslam");
    return points_of_map(folder / "map.roslam", most, run);
  }
  run.notes.push_back((folder / "map.ply").string() + ": no such file");
  return {};
}

bool has_entries(const fs::path& folder) {
  std::error_code error;
  return fs::is_directory(folder, error) && fs::directory_iterator(folder, error) != fs::directory_iterator();
}
}  // namespace

RunContents read_run_contents(const fs::path& folder, std::size_t most_points) {
  RunContents run;
  run.source = source_of_run(folder);
  run.trajectory = trajectory_if_any(folder / "trajectory.txt", run);
  if (const fs::path file = folder / "odometry.csv"; is_there(file)) {
    run.odometry = read_odometry(file);
  } else {
    run.notes.push_back(file.string() + ": no such file; odom is the frame map");
  }
  if (is_there(folder / "groundtruth.txt") && has_lines(folder / "groundtruth.txt"))
    run.truth = read_trajectory(folder / "groundtruth.txt").trajectory;
  run.landmarks = landmarks_of(folder, most_points, run);
  if (const fs::path file = folder / "dense.ply"; is_there(file)) {
    run.dense = points_of_ply(file, most_points, run);
  } else {
    run.notes.push_back(file.string() + ": no such file");
  }
  if (has_entries(folder / kMaskFolder)) run.masks = folder / kMaskFolder;
  if (run.trajectory.empty() && run.odometry.empty() && run.landmarks.empty() && run.dense.empty())
    throw InputError(folder.string() + ": the run has neither a pose nor a map; repeat it");
  return run;
}

std::optional<SE3> place_of_truth(const RunContents& run) {
  std::vector<SE3> truth, estimate;
  for (const auto& pair : evaluation::associate(run.truth, run.trajectory, {})) {
    truth.push_back(pair.truth.T_world_camera);
    estimate.push_back(pair.estimate.T_world_camera);
  }
  return align_poses(truth, estimate);
}

}  // namespace roslam::recording
