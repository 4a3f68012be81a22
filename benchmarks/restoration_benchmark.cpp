// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "benchmarks/benchmarks.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"

namespace roslam::benchmarks {

namespace {
// Two objects removed from a 640x480 keyframe: a person and a car.
const cv::Rect kPerson(180, 120, 110, 300);
const cv::Rect kCar(360, 220, 240, 150);

PosedImage taken(const Frame& frame, const std::vector<cv::Rect>& objects) {
  PosedImage view{frame.timestamp, frame.T_world_camera, frame.colour, frame.depth,
                  cv::Mat::zeros(frame.colour.size(), CV_8UC1)};
  for (const cv::Rect& object : objects)
    cv::ellipse(view.removed, cv::RotatedRect((object.tl() + object.br()) / 2, object.size(), 0), 255,
                cv::FILLED);
  return view;
}

std::shared_ptr<Inpainter> network() {
  const auto models = find_restoration_models();
  return models.empty() ? nullptr : std::make_shared<GanInpainter>(models);
}

// Reprojects from ten images that show everything hidden, or from none; the rest is inpainted by the network
// or by a classic method.
void restore(benchmark::State& state, RenderedFlight& flight, bool is_seen, bool by_network) {
  auto inpainter = by_network ? network() : nullptr;
  if (by_network && !inpainter) {
    state.SkipWithError("models/roslam-restorer-*.onnx not found");
    return;
  }
  const std::vector<Frame>& frames = flight.frames();
  StaticSceneRestorer restorer(flight.camera(), {}, inpainter);
  std::vector<SourceImage> views;
  for (std::size_t i = 1; is_seen && i < frames.size() && views.size() < 10; ++i)
    if (auto source = restorer.prepare_source(taken(frames[i], {}))) views.push_back(std::move(*source));
  std::vector<const SourceImage*> sources;
  for (const SourceImage& view : views) sources.push_back(&view);
  const PosedImage target = taken(frames.front(), {kPerson, kCar});
  const std::vector<RemovedRegion> regions{{Movable::kPerson, square_around(kPerson)},
                                           {Movable::kCar, square_around(kCar)}};
  for (auto _ : state) {
    const RestoredImage restored = restorer.restore(target, regions, sources);
    benchmark::DoNotOptimize(restored.colour.data);
  }
}

void prepare(benchmark::State& state, RenderedFlight& flight) {
  const PosedImage view = taken(flight.frames().front(), {kPerson, kCar});
  for (auto _ : state) {
    const auto source = prepare_source(view, {});
    benchmark::DoNotOptimize(source->depth.data);
  }
}
}  // namespace

void register_restoration_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  using benchmark::RegisterBenchmark;
  const auto add = [&](const char* name, bool is_seen, bool by_network) {
    RegisterBenchmark(name, [=](auto& state) {
      restore(state, *flight, is_seen, by_network);
    })->Unit(benchmark::kMillisecond);
  };
  add("restoration/keyframe_seen_elsewhere", true, true);
  add("restoration/keyframe_never_seen", false, true);
  add("restoration/keyframe_never_seen_without_network", false, false);
  RegisterBenchmark("restoration/prepare_source", [=](auto& state) {
    prepare(state, *flight);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
