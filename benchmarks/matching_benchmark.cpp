// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <numeric>

#include "benchmarks/benchmarks.hpp"
#include "roslam/matching/projection_matcher.hpp"

namespace roslam::benchmarks {

namespace {
constexpr std::uint32_t kSeed = 1;
constexpr std::size_t kPoints = 1000;
constexpr int kFlippedBits = 15;  // bits of a descriptor that noise and a small rotation change, about

void match_by_brute_force(benchmark::State& state) {
  std::mt19937 random(kSeed);
  const ObservedFrame a = random_frame(kPoints, random);
  const ObservedFrame b = seen_again(a, kFlippedBits, random);
  std::vector<std::uint32_t> all(a.size());
  std::iota(all.begin(), all.end(), 0U);
  std::size_t matches = 0;
  for (auto _ : state) {
    const auto pairs = match_descriptors(a, all, b, {});
    matches = pairs.size();
    benchmark::DoNotOptimize(pairs.data());
  }
  if (matches < kPoints * 9 / 10) state.SkipWithError("fewer than 90 % of the points were matched");
  state.counters["matches"] = static_cast<double>(matches);
}

void match_by_projection(benchmark::State& state) {
  constexpr float kRadius = 7.0F;
  std::mt19937 random(kSeed);
  const ObservedFrame last = random_frame(kPoints, random);
  const ObservedFrame frame = seen_again(last, kFlippedBits, random);
  const MatcherOptions options;
  ProjectionMatcher matcher(options);
  std::size_t matches = 0;
  for (auto _ : state) {
    std::vector<LandmarkId> taken(frame.size());
    matches = 0;
    for (std::uint32_t i = 0; i < last.size(); ++i) {
      const int level = last.levels[i];
      const ProjectionMatcher::Query query{
          last.pixels[i], kRadius, level - 1, level + 1, last.depths[i], options.max_distance, false};
      const int found = matcher.find(query, last.descriptors[i], frame, taken);
      if (found < 0) continue;
      taken[static_cast<std::size_t>(found)] = LandmarkId{i};
      ++matches;
    }
  }
  if (matches < kPoints * 9 / 10) state.SkipWithError("fewer than 90 % of the points were matched");
  state.counters["matches"] = static_cast<double>(matches);
}
}  // namespace

void register_matching_benchmarks() {
  benchmark::RegisterBenchmark("matching/brute_force", match_by_brute_force)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("matching/projection", match_by_projection)->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
