// SPDX-License-Identifier: BSD-3-Clause
// The own inference engine against OpenCV, by turns in one run: processor time of each, the median of the
// ratios of all turns, and GFLOP/s beside what the core can do at most, measured in between.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/benchmarks.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/common/upper_median.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/inference/network_runner.hpp"
#include "roslam/inference/plan/onnx_graph.hpp"
#include "roslam/restoration/inpainter.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::benchmarks {

namespace {
template <typename Work>
double seconds_of(const Work& work) {
  const Stopwatch watch;
  work();
  return watch.seconds();
}

// Multiply-adds a second that the core reaches where nothing but arithmetic limits it.
double peak_rate(const Kernels& kernels) {
  constexpr int kRounds = 20000;
  double operations = 0.0;
  const double seconds = seconds_of([&] { operations = kernels.peak(kRounds); });
  return operations / seconds;
}

NetworkPlan plan_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return plan_network(read_onnx(std::string(std::istreambuf_iterator<char>(in), {})));
}

cv::Mat noise(int channels, int rows, int columns) {
  const int size[] = {1, channels, rows, columns};
  cv::Mat blob(4, size, CV_32F);
  cv::RNG(1).fill(blob, cv::RNG::UNIFORM, 0.0, 1.0);
  return blob;
}

void by_turns(benchmark::State& state, const std::filesystem::path& file, const Kernels* kernels, int rows,
              int columns) {
  if (file.empty() || !has_opencv_dnn()) {
    state.SkipWithError("the models or OpenCV's dnn module are missing");
    return;
  }
  NetworkRunner own(plan_of(file), *kernels, 1);
  own.prepare(rows, columns);
  const auto opencv = load_inference(file, InferenceBackend::kOpenCv);
  const cv::Mat blob = noise(own.input_channels(), rows, columns);
  own.set_input(blob.ptr<float>());
  own.run();  // the first runs of both allocate memory
  opencv->run(blob);
  std::vector<double> own_seconds, opencv_seconds, ratios;
  double peak = 0.0;
  for (auto _ : state) {
    own_seconds.push_back(seconds_of([&] {
      own.set_input(blob.ptr<float>());
      own.run();
    }));
    opencv_seconds.push_back(seconds_of([&] { opencv->run(blob); }));
    ratios.push_back(opencv_seconds.back() / own_seconds.back());
    state.PauseTiming();
    peak = std::max(peak, peak_rate(*kernels));
    state.ResumeTiming();
  }
  const double least = *std::min_element(own_seconds.begin(), own_seconds.end());
  state.counters["own_ms"] = 1e3 * upper_median(own_seconds);
  state.counters["opencv_ms"] = 1e3 * upper_median(opencv_seconds);
  state.counters["times_faster"] = upper_median(ratios);
  state.counters["GFLOP/s"] = 2e-9 * own.multiply_adds() / least;
  state.counters["peak_GFLOP/s"] = 2e-9 * peak;
}

// From the file to the labels of a first image.
void start_up(benchmark::State& state, const cv::Mat& image, InferenceBackend backend) {
  for (auto _ : state) {
    PspnetSegmenter segmenter(find_segmentation_model(), {}, backend);
    const Segmentation segmentation = segmenter.segment(image);
    benchmark::DoNotOptimize(segmentation.labels.data);
  }
}
}  // namespace

void register_inference_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  using benchmark::RegisterBenchmark;
  const auto segmenter = find_segmentation_model();
  const auto models = find_restoration_models();
  const std::filesystem::path restorer = models.empty() ? models : models / "roslam-restorer-person.onnx";
  std::vector<const Kernels*> all;
  if (best_kernels() != nullptr) all.push_back(best_kernels());
  if (best_kernels() == avx512_kernels() && best_kernels() != nullptr) all.push_back(avx2_kernels());
  for (const Kernels* kernels : all) {
    const std::string name = std::string("inference/by_turns/") + kernels->name;
    RegisterBenchmark((name + "/segmenter_416x320").c_str(), [=](auto& state) {
      by_turns(state, segmenter, kernels, 320, 416);
    })->Unit(benchmark::kMillisecond);
    RegisterBenchmark((name + "/restorer_256x256").c_str(), [=](auto& state) {
      by_turns(state, restorer, kernels, 256, 256);
    })->Unit(benchmark::kMillisecond);
  }
  for (const auto& [name, backend] :
       {std::pair("own", InferenceBackend::kOwn), std::pair("opencv", InferenceBackend::kOpenCv)}) {
    if (segmenter.empty() || (backend == InferenceBackend::kOwn ? all.empty() : !has_opencv_dnn())) continue;
    RegisterBenchmark((std::string("inference/start_up/") + name).c_str(), [=,
                                                                            backend = backend](auto& state) {
      start_up(state, flight->frames().front().colour, backend);
    })->Unit(benchmark::kMillisecond);
  }
}

}  // namespace roslam::benchmarks
