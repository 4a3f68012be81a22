// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/map_evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "apps/roslam/support/progress.hpp"
#include "evaluation/association.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "roslam/common/error.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/alignment.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

// A run's map, not read yet, and its alignment with the truth.
struct AlignedMap {
  fs::path file;
  SE3 T_truth_world;
  double rmse = 0.0;  // of the camera positions, metres
};

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

fs::path map_of(const fs::path& run) {
  if (is_file(run)) return run;
  fs::path file = run / "dense.ply";
  if (!is_file(file)) throw InputError(file.string() + ": is missing; repeat the run without --no-dense");
  return file;
}

// Also reports missing files before the truth is gathered, which takes long.
AlignedMap aligned_map(const fs::path& run, const Trajectory& truth) {
  AlignedMap map{map_of(run), {}, 0.0};
  const fs::path file = map.file.parent_path() / "trajectory.txt";
  AssociationOptions association;
  association.interpolate = true;
  const auto pairs = associate(truth, read_trajectory(file).trajectory, association);
  std::vector<SE3> estimated, true_poses;
  for (const auto& pair : pairs) {
    estimated.push_back(pair.estimate.T_world_camera);
    true_poses.push_back(pair.truth.T_world_camera);
  }
  const auto T_truth_world = align_poses(estimated, true_poses);
  if (!T_truth_world) {
    throw InputError(
        file.string() +
        ": has no pose at a time of the truth; is it a run of the same sequence, by the same clock?");
  }
  map.T_truth_world = *T_truth_world;
  double squares = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    squares += (*T_truth_world * estimated[i].translation() - true_poses[i].translation()).squaredNorm();
  map.rmse = std::sqrt(squares / static_cast<double>(pairs.size()));
  return map;
}

SurfaceMap read_aligned(const AlignedMap& map) {
  return moved(read_surface_ply(map.file), map.T_truth_world);
}

MapTruth gather(const MapEvaluationSettings& settings, const MapSequence& sequence) {
  MapTruth truth(sequence.camera(), settings.truth_options);
  Progress progress(sequence.size(), settings.quiet);
  for (std::size_t i = 0; i < sequence.size(); i += settings.every) {
    try {
      if (const auto frame = sequence.frame(i)) truth.add(*frame);
    } catch (const InputError& error) {
      throw InputError(settings.truth.sequence.string() + ": " + error.what());
    }
    progress.show(i + 1, "truth gathered");
  }
  const auto& points = truth.static_points();
  if (std::none_of(points.begin(), points.end(), [&](const auto& point) { return truth.is_near(point); })) {
    throw InputError(settings.truth.sequence.string() + ": the depth of its background is nowhere within " +
                     fixed(settings.truth_options.range, 1) +
                     " m of a known pose; check groundtruth.txt and the units of depth, or raise --range");
  }
  return truth;
}
}  // namespace

namespace {
// Maps and truth are in the same world frame.
std::vector<EvaluatedMap> compare_with_cloud(const MapEvaluationSettings& settings) {
  const SurfaceMap truth = read_surface_ply(settings.truth.sequence);
  if (truth.points.empty())
    throw InputError(settings.truth.sequence.string() + ": has no points; give another truth");
  MapComparison comparison(MapTruth(truth, settings.truth_options), settings.error_options);
  if (!settings.reference.empty()) comparison.set_reference(read_surface_ply(map_of(settings.reference)));
  std::vector<EvaluatedMap> maps;
  for (const auto& run : settings.estimates) {
    maps.push_back({run.name, std::numeric_limits<double>::quiet_NaN(),
                    comparison.error(read_surface_ply(map_of(run.path)))});
  }
  return maps;
}
}  // namespace

std::vector<EvaluatedMap> evaluate_maps(const MapEvaluationSettings& settings) {
  if (is_file(settings.truth.sequence)) return compare_with_cloud(settings);
  const MapSequence sequence(settings.truth);
  std::vector<AlignedMap> aligned;
  for (const auto& run : settings.estimates) aligned.push_back(aligned_map(run.path, sequence.trajectory()));
  std::optional<AlignedMap> reference;
  if (!settings.reference.empty()) reference = aligned_map(settings.reference, sequence.trajectory());
  MapComparison comparison(gather(settings, sequence), settings.error_options);
  if (reference) comparison.set_reference(read_aligned(*reference));
  std::vector<EvaluatedMap> maps;
  for (std::size_t i = 0; i < aligned.size(); ++i)
    maps.push_back({settings.estimates[i].name, aligned[i].rmse, comparison.error(read_aligned(aligned[i]))});
  return maps;
}

}  // namespace roslam::app
