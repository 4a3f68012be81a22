// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "benchmarks/benchmarks.hpp"

namespace roslam::benchmarks {

namespace {
// 10 keyframes, 1000 points, 5000 observations: a typical local bundle adjustment indoors.
void adjust(benchmark::State& state) {
  constexpr std::uint32_t kSeed = 3;
  std::mt19937 random(kSeed);
  const BundleProblem start = make_bundle({}, random);
  const Camera camera = synthetic_camera();
  BundleSummary summary;
  for (auto _ : state) {
    state.PauseTiming();
    BundleProblem problem = start;
    state.ResumeTiming();
    summary = adjust_bundle(camera, problem, {});
    benchmark::DoNotOptimize(problem.poses.data());
  }
  if (!summary.is_usable || summary.final_cost > 0.5 * summary.initial_cost) {
    state.SkipWithError("bundle adjustment did not reduce the cost");
  }
  state.counters["observations"] = static_cast<double>(start.terms.size());
  state.counters["steps"] = summary.iterations;
}
}  // namespace

void register_bundle_benchmarks() {
  benchmark::RegisterBenchmark("mapping/local_bundle_adjustment", adjust)->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
