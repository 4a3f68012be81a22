// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "benchmarks/benchmarks.hpp"

namespace roslam::benchmarks {

namespace {
void optimise(benchmark::State& state) {
  constexpr std::uint32_t kSeed = 2;
  constexpr double kOutlierShare = 0.2;
  constexpr double kTolerance = 0.02;  // metres: a fast answer that is wrong is no result
  std::mt19937 random(kSeed);
  const PoseScene scene = make_pose_scene(static_cast<std::size_t>(state.range(0)), kOutlierShare, random);
  const Camera camera = synthetic_camera();
  OptimisedPose result;
  for (auto _ : state) {
    result = optimise_pose(camera, scene.measurements, scene.initial_T_camera_world);
    benchmark::DoNotOptimize(result.inliers);
  }
  const SE3 error = result.T_camera_world * scene.true_T_camera_world.inverse();
  if (error.translation().norm() > kTolerance) state.SkipWithError("the optimiser missed the true pose");
  state.counters["inliers"] = result.inliers;
}
}  // namespace

void register_pose_benchmarks() {
  benchmark::RegisterBenchmark("pose/optimise", optimise)
      ->ArgName("measurements")
      ->Arg(100)
      ->Arg(300)
      ->Arg(600)
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace roslam::benchmarks
