// SPDX-License-Identifier: BSD-3-Clause
// Run time of each stage. For comparable figures, on an otherwise idle machine:
//   roslam_benchmarks --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
// and for one stage: roslam_benchmarks --benchmark_filter=pose
// The CPU column is the reliable one; all inputs are made from fixed seeds.
#include <benchmark/benchmark.h>

#include "benchmarks/benchmarks.hpp"

int main(int argc, char** argv) {
  namespace rb = roslam::benchmarks;
  constexpr std::size_t kFrames = 30;
  constexpr int kUsageError = 2;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return kUsageError;
  const auto flight = std::make_shared<rb::RenderedFlight>(kFrames);
  rb::register_feature_benchmarks(flight);
  rb::register_matching_benchmarks();
  rb::register_pose_benchmarks();
  rb::register_bundle_benchmarks();
  rb::register_place_benchmarks(flight);
  rb::register_restoration_benchmarks(flight);
  rb::register_dense_benchmarks(flight);
  rb::register_inference_benchmarks(flight);
  rb::register_segmentation_benchmarks(flight);
  rb::register_sensors_benchmarks();
  rb::register_slam_benchmarks(flight);
  rb::register_stereo_benchmarks();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
