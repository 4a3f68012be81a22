// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "benchmarks/benchmarks.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/features/stereo_matcher.hpp"
#include "roslam/stereo/dense_stereo.hpp"
#include "roslam/stereo/stereo_rectifier.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::benchmarks {

namespace {
// A pair of the simulated street at the size of EuRoC's images.
struct Pair {
  Camera camera;
  cv::Mat left, right;  // grey

  static const Pair& instance() {
    static const Pair pair = [] {
      simulation::SimulatorOptions options;
      options.stereo = true;
      simulation::Simulator simulator(options);
      const Frame frame = simulator.render(0).frame;
      constexpr int kWidth = 752, kHeight = 480;
      Pair made{simulator.camera(), {}, {}};
      cv::cvtColor(frame.colour, made.left, cv::COLOR_BGR2GRAY);
      for (const auto& [from, to] : {std::pair{made.left, &made.left}, std::pair{frame.right, &made.right}})
        cv::resize(from, *to, {kWidth, kHeight});
      const double x = static_cast<double>(kWidth) / made.camera.width;
      const double y = static_cast<double>(kHeight) / made.camera.height;
      made.camera.width = kWidth;
      made.camera.height = kHeight;
      made.camera.fx *= x;
      made.camera.cx *= x;
      made.camera.fy *= y;
      made.camera.cy *= y;
      return made;
    }();
    return pair;
  }
};

void match(benchmark::State& state) {
  const Pair& pair = Pair::instance();
  const OrbExtractor extractor;
  const StereoMatcher matcher(pair.camera, {});
  const auto features = extractor.extract(pair.left);
  const auto left = extractor.pyramid(pair.left);
  std::size_t matched = 0;
  for (auto _ : state) {
    const auto found = matcher.match(features, left, extractor.pyramid(pair.right));
    matched =
        static_cast<std::size_t>(std::count_if(found.begin(), found.end(), [](auto& d) { return !!d; }));
  }
  state.counters["points"] = static_cast<double>(features.size());
  state.counters["matched"] = static_cast<double>(matched);
}

void dense(benchmark::State& state) {
  const Pair& pair = Pair::instance();
  const DenseStereo stereo(pair.camera, {});
  for (auto _ : state) benchmark::DoNotOptimize(stereo.depth(pair.left, pair.right).data);
}

void rectify(benchmark::State& state) {
  const Pair& pair = Pair::instance();
  Camera raw = pair.camera;
  raw.baseline = 0.0;
  raw.set_lens("pinhole", {-0.28, 0.07});
  const StereoRectifier rectifier(raw, {raw, SE3(so3_exp({0.01, 0.0, 0.01}), {0.12, 0.0, 0.0})});
  for (auto _ : state) {
    benchmark::DoNotOptimize(rectifier.left(pair.left).data);
    benchmark::DoNotOptimize(rectifier.right(pair.right).data);
  }
}
}  // namespace

void register_stereo_benchmarks() {
  using benchmark::RegisterBenchmark;
  RegisterBenchmark("stereo/match", match)->Unit(benchmark::kMillisecond);
  RegisterBenchmark("stereo/dense", dense)->Unit(benchmark::kMillisecond);
  RegisterBenchmark("stereo/rectify", rectify)->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
