// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>

#include "benchmarks/benchmarks.hpp"
#include "roslam/features/orb_extractor.hpp"

namespace roslam::benchmarks {

namespace {
enum class Masked { kNo, kYes };

// Two walking people in front of the camera hide about a fifth of the image.
cv::Mat mask_of_people(const cv::Size& size) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8UC1);
  for (const int x : {size.width / 4, size.width / 2}) {
    cv::rectangle(mask, cv::Rect(x, size.height / 4, size.width / 8, size.height * 3 / 4), 255, cv::FILLED);
  }
  return mask;
}

void extract_orb(benchmark::State& state, RenderedFlight& flight, Masked masked) {
  cv::Mat grey;
  cv::cvtColor(flight.frames().front().colour, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat mask = masked == Masked::kYes ? mask_of_people(grey.size()) : cv::Mat();
  const OrbExtractor extractor;
  std::size_t points = 0;
  for (auto _ : state) {
    const auto features = extractor.extract(grey, mask);
    points = features.size();
    benchmark::DoNotOptimize(features.data());
  }
  state.counters["points"] = static_cast<double>(points);
}

void observe_points(benchmark::State& state, RenderedFlight& flight) {
  const Frame& frame = flight.frames().front();
  cv::Mat grey;
  cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
  const auto features = OrbExtractor().extract(grey);
  for (auto _ : state) {
    const ObservedFrame observed = observe(features, frame.colour, frame.depth, flight.camera(), {});
    benchmark::DoNotOptimize(observed.pixels.data());
  }
}
}  // namespace

void register_feature_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  using benchmark::RegisterBenchmark;
  RegisterBenchmark("features/orb", [flight](auto& state) {
    extract_orb(state, *flight, Masked::kNo);
  })->Unit(benchmark::kMillisecond);
  RegisterBenchmark("features/orb_masked", [flight](auto& state) {
    extract_orb(state, *flight, Masked::kYes);
  })->Unit(benchmark::kMillisecond);
  RegisterBenchmark("features/observe", [flight](auto& state) {
    observe_points(state, *flight);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
