// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "benchmarks/benchmarks.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/options/options.hpp"
#include "roslam/options/settings.hpp"
#include "tests/loop_scene.hpp"

namespace roslam::benchmarks {

namespace {
using Clock = std::chrono::steady_clock;
constexpr std::size_t kIndexed = 1000;  // keyframes in the database
constexpr int kAround = 500;            // keyframes of the loop
constexpr int kFurther = 20;            // keyframes after it

std::shared_ptr<const Vocabulary> vocabulary() {
  return std::make_shared<const Vocabulary>(Vocabulary::load(find_vocabulary()));
}

// Images of a street, each repeated with different noise: they share more words than keyframes of a flight.
void query(benchmark::State& state, RenderedFlight& flight) {
  const OrbExtractor extractor{OrbOptions{}};
  std::vector<std::vector<Descriptor>> images;
  for (const auto& frame : flight.frames()) {
    cv::Mat grey;
    cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
    auto& descriptors = images.emplace_back();
    for (const auto& feature : extractor.extract(grey)) descriptors.push_back(feature.descriptor);
  }
  std::mt19937_64 random(1);
  KeyframeDatabase database(vocabulary());
  std::vector<Descriptor> newest;
  for (std::uint32_t i = 0; i < kIndexed; ++i) {
    newest = images[i % images.size()];
    for (auto& descriptor : newest) {
      for (int k = 0; k < 15; ++k) descriptor[random() % 4] ^= std::uint64_t{1} << (random() % 64);
    }
    database.add(KeyframeId{i}, database.vocabulary().describe(newest));
  }
  std::size_t found = 0;
  for (auto _ : state) {
    const auto similar = database.similar(database.vocabulary().describe(newest));
    found = similar.size();
    benchmark::DoNotOptimize(similar.data());
  }
  if (found < kIndexed / 2) state.SkipWithError("fewer than half of the images have words in common");
  state.counters["keyframes"] = static_cast<double>(found);
}

// A flight once around and a little further; the keyframes of the first round are in the database.
struct Around {
  Around() {
    flight.build_ring(18000);  // 800 points a keyframe
    for (int i = 0; i < kAround + kFurther; ++i) {
      const KeyframeId id = flight.fly_to(scene::WallFlight::on_ring(kStep * i), 0.0005, map);
      if (i < kAround) database.add(id, database.describe(*map.find(id)->view));
    }
  }

  static constexpr double kStep = 2.0 * M_PI / kAround;
  scene::WallFlight flight{7};
  Map map{{1.0F, 1.2F, 1.44F, 1.728F}};
  KeyframeDatabase database{vocabulary()};
};

// Closes a loop while another thread locks the map as a tracker does; reports its longest wait.
void close_loop(benchmark::State& state) {
  double longest_wait = 0.0;
  for (auto _ : state) {
    state.PauseTiming();
    Around around;
    MapMutex mutex;
    LoopCloser closer(around.flight.camera(), around.map, around.database, mutex, loop_settings(Options{}));
    std::atomic<double> longest = 0.0;
    std::mutex pause_mutex;
    std::condition_variable_any tick;
    std::jthread tracker([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const auto asked = Clock::now();
        {
          const MapLock lock(mutex, "benchmark");
          longest = std::max(longest.load(), std::chrono::duration<double>(Clock::now() - asked).count());
        }
        std::unique_lock pause(pause_mutex);
        tick.wait_for(pause, stop, std::chrono::milliseconds(1), [] { return false; });
      }
    });
    state.ResumeTiming();
    for (std::uint32_t i = kAround; i < kAround + kFurther && closer.closed().empty(); ++i)
      closer.process(KeyframeId{i});
    tracker.request_stop();
    tracker.join();
    if (closer.closed().empty()) state.SkipWithError("the loop was not closed");
    longest_wait = std::max(longest_wait, longest.load());
    state.counters["landmarks"] = static_cast<double>(around.map.landmark_count());
  }
  state.counters["blocked_ms"] = 1e3 * longest_wait;
}

void save_and_load(benchmark::State& state, bool loads) {
  const Around around;
  const SavedMap saved = SavedMap::of(around.flight.camera(), around.map, &around.database);
  const auto file = std::filesystem::temp_directory_path() / "roslam_benchmark.roslam";
  save_map(file, saved);
  for (auto _ : state) {
    if (loads) {
      benchmark::DoNotOptimize(load_map(file).map.keyframe_count());
    } else {
      save_map(file, saved);
    }
  }
  state.counters["MB"] = static_cast<double>(std::filesystem::file_size(file)) / 1048576.0;
  state.counters["keyframes"] = static_cast<double>(saved.map.keyframe_count());
  std::filesystem::remove(file);
}
}  // namespace

void register_place_benchmarks(const std::shared_ptr<RenderedFlight>& flight) {
  if (find_vocabulary().empty()) return;
  benchmark::RegisterBenchmark("places/query_1000", [flight](auto& state) {
    query(state, *flight);
  })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("loop/close_500", close_loop)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->Iterations(1);
  for (const bool loads : {false, true}) {
    benchmark::RegisterBenchmark(loads ? "map/load_500" : "map/save_500",
                                 [loads](auto& state) { save_and_load(state, loads); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

}  // namespace roslam::benchmarks
