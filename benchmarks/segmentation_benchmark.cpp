// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "benchmarks/benchmarks.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/semantics/score_labels.hpp"

namespace roslam::benchmarks {

namespace {
// From a 640x480 image to its labels; state.range(0) is the longer side of the network input.
void segment(benchmark::State& state, RenderedFlight& flight, InferenceBackend backend) {
  const auto model = find_segmentation_model();
  if (model.empty()) {
    state.SkipWithError("models/roslam-pspnet.onnx not found");
    return;
  }
  PspnetSegmenter segmenter(model, {static_cast<int>(state.range(0))}, backend);
  for (auto _ : state) {
    const Segmentation segmentation = segmenter.segment(flight.frames().front().colour);
    benchmark::DoNotOptimize(segmentation.labels.data);
  }
}

// The last step alone: scores of a street in broad areas of few classes.
void label_scores(benchmark::State& state) {
  const int size[] = {1, kClasses, 144, 192};
  cv::Mat scores(4, size, CV_32F, cv::Scalar(0));
  for (int c = 0; c < kClasses; ++c) {
    for (int i = 0; i < 144 * 192; ++i) {
      scores.ptr<float>(0, c)[i] =
          static_cast<float>((i / 192 / 24 + i % 192 / 24) % kClasses == c ? 5 : c % 3);
    }
  }
  const ScoreGrid grid = ScoreGrid::from_planes(scores);
  for (auto _ : state) {
    const Segmentation segmentation = labels_from_scores(grid, {640, 480});
    benchmark::DoNotOptimize(segmentation.labels.data);
  }
}
}  // namespace

void register_segmentation_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  using benchmark::RegisterBenchmark;
  for (const auto& [name, backend] :
       {std::pair("segmentation/own", InferenceBackend::kOwn),
        std::pair("segmentation/opencv", InferenceBackend::kOpenCv),
        std::pair("segmentation/onnx_runtime", InferenceBackend::kOnnxRuntime)}) {
    if (backend == InferenceBackend::kOnnxRuntime && !has_onnx_runtime()) continue;
    if (backend == InferenceBackend::kOpenCv && !has_opencv_dnn()) continue;
    if (backend == InferenceBackend::kOwn && own_instruction_set().empty()) continue;
    RegisterBenchmark(name, [flight, backend = backend](auto& state) { segment(state, *flight, backend); })
        ->Unit(benchmark::kMillisecond)
        ->Arg(256)
        ->Arg(320)
        ->Arg(384)
        ->Arg(416)
        ->Arg(480)
        ->Arg(512)
        ->Arg(640);
  }
  RegisterBenchmark("segmentation/label_scores", [](auto& state) {
    label_scores(state);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
