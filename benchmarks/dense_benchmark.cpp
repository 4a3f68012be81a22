// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>

#include "benchmarks/benchmarks.hpp"
#include "roslam/dense/dense_mapper.hpp"
#include "roslam/occupancy/occupancy_map.hpp"

namespace roslam::benchmarks {

namespace {
constexpr std::size_t kKeyframes = 20;

// A map of the first frames of the street, fused at their true poses.
DenseMapper mapped(RenderedFlight& flight, const DepthKeyframeReducer& reducer, std::size_t count) {
  DenseMapper mapper({}, {});
  for (std::size_t i = 0; i < count; ++i) {
    const Frame& frame = flight.frames()[i];
    mapper.insert({static_cast<std::uint32_t>(i)}, reducer.reduce(frame.colour, frame.depth, {}, {}),
                  {SubmapId{0}, *frame.T_world_camera});
  }
  return mapper;
}

// Fuses one more keyframe, from image to voxels.
void fuse(benchmark::State& state, RenderedFlight& flight) {
  const DepthKeyframeReducer reducer(flight.camera(), {}, {});
  const std::size_t count = std::min(kKeyframes, flight.frames().size() - 1);
  DenseMapper mapper = mapped(flight, reducer, count);
  const Frame& frame = flight.frames()[count];
  std::uint32_t id = kKeyframes;
  for (auto _ : state) {
    mapper.insert({id++}, reducer.reduce(frame.colour, frame.depth, {}, {}),
                  {SubmapId{0}, *frame.T_world_camera});
    benchmark::DoNotOptimize(mapper.voxel_bytes());
  }
}

void extract(benchmark::State& state, RenderedFlight& flight) {
  const DepthKeyframeReducer reducer(flight.camera(), {}, {});
  const DenseMapper mapper = mapped(flight, reducer, std::min(kKeyframes, flight.frames().size()));
  std::size_t points = 0;
  for (auto _ : state) {
    points = mapper.surface(SubmapId{0}).points.size();
    benchmark::DoNotOptimize(points);
  }
  state.counters["points"] = static_cast<double>(points);
}

// Occupancy map with cells of 0.1 m.
void occupy(benchmark::State& state, RenderedFlight& flight) {
  const DepthKeyframeReducer reducer(flight.camera(), {}, {});
  const DenseMapper mapper = mapped(flight, reducer, std::min(kKeyframes, flight.frames().size()));
  const SurfaceMap surface = mapper.surface(SubmapId{0});
  double free = 0.0;
  for (auto _ : state) {
    free = occupancy_map_of(mapper, SubmapId{0}, surface, 0.1).free_volume();
    benchmark::DoNotOptimize(free);
  }
  state.counters["m3_free"] = free;
}
}  // namespace

void register_dense_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  using benchmark::RegisterBenchmark;
  RegisterBenchmark("dense/fuse_keyframe", [=](auto& state) {
    fuse(state, *flight);
  })->Unit(benchmark::kMillisecond);
  RegisterBenchmark("dense/surface_of_20_keyframes", [=](auto& state) {
    extract(state, *flight);
  })->Unit(benchmark::kMillisecond);
  RegisterBenchmark("dense/occupancy_of_20_keyframes", [=](auto& state) {
    occupy(state, *flight);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
