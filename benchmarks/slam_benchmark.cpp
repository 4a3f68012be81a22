// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "benchmarks/benchmarks.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam::benchmarks {

namespace {
// Index of a frame flown back and forth: continuous motion of any length from a few images.
std::size_t there_and_back(std::size_t step, std::size_t frames) {
  const std::size_t period = 2 * (frames - 1);
  const std::size_t at = step % period;
  return at < frames ? at : period - at;
}

// A frame through the whole deterministic pipeline: tracking, and mapping if it became a keyframe.
void process(benchmark::State& state, RenderedFlight& flight) {
  const auto& frames = flight.frames();
  const Camera& camera = flight.camera();
  Slam slam(camera);
  std::size_t step = 0;
  std::size_t tracked = 0;
  for (auto _ : state) {
    state.PauseTiming();
    Frame frame = frames[there_and_back(step, frames.size())];
    frame.index = step;
    frame.timestamp = static_cast<double>(step) / camera.fps;
    state.ResumeTiming();
    const auto result = slam.process(frame);
    if (result.T_world_camera) ++tracked;
    ++step;
  }
  if (tracked != step) state.SkipWithError("a frame was not tracked");
  state.counters["keyframes"] = static_cast<double>(slam.map().keyframe_count());
}
}  // namespace

void register_slam_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  benchmark::RegisterBenchmark("slam/frame", [flight](auto& state) {
    process(state, *flight);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
