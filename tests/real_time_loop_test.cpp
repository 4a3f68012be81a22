// SPDX-License-Identifier: BSD-3-Clause
// A loop closed on a thread of its own while keyframes are added and mapped and their poses are read, as in
// real-time mode. Meant for the thread sanitizer as well.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/map/keyframe_pose_table.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/options/options.hpp"
#include "roslam/workers/keyframe_worker.hpp"
#include "roslam/options/settings.hpp"
#include "tests/loop_scene.hpp"

namespace roslam::scene {
namespace {

constexpr double kStep = 0.05;                               // radians between keyframes on the ring
constexpr double kStepLength = kStep * WallFlight::kRadius;  // metres
constexpr double kBeforeLoop = 2.0 * M_PI - 0.3;             // radians flown before anything is seen twice
constexpr std::size_t kAdded = 4;  // keyframes that are added during each part of the correction

// The pipeline around the map, without the tracker: the thread of the test adds keyframes, one worker maps
// them, another closes loops, and two threads read.
class RealTimeLoop : public testing::Test {
 protected:
  RealTimeLoop() {
    flight_.build_ring();
    std::vector<std::vector<Descriptor>> images;
    for (int i = 0; i < 60; ++i) images.push_back(flight_.view(WallFlight::on_ring(0.11 * i))->descriptors);
    places_.emplace(
        std::make_shared<const Vocabulary>(Vocabulary::train(images, {.branching = 10, .depth = 3})));
  }

  ~RealTimeLoop() override { stop_readers(); }

  // map_keyframe: what the mapper does with a keyframe.
  void start(const Camera& camera, KeyframeWorker::Work map_keyframe) {
    constexpr int kNeverInterrupted = 1000;  // keyframes
    map_keyframe_ = std::move(map_keyframe);
    closer_.emplace(camera, map_, *places_, mutex_, loop_settings(Options()));
    closing_.emplace([this](auto&&... work) { noting_failure([&] { close(work...); }); }, Mode::kRealTime,
                     kNeverInterrupted);
    mapping_.emplace([this](auto&&... work) { noting_failure([&] { map_and_hand_on(work...); }); },
                     Mode::kRealTime, 1);
    readers_.emplace_back([this] { read([this] { read_poses(); }); });
    readers_.emplace_back([this] { read([this] { read_map(); }); });
  }

  // Adds the keyframe at that angle, as LocalMapper::insert does, and hands it to the mapper.
  void add(double angle, double drift) {
    KeyframeId id;
    {
      const MapLock lock(mutex_, "test");
      id = flight_.fly_to(WallFlight::on_ring(angle), drift, map_);
      poses_.add(map_, id);
    }
    {
      const std::scoped_lock lock(state_mutex_);
      ++version_;
      ++unfinished_;
      added_ = id.index() + 1;
    }
    changed_.notify_all();
    mapping_->submit(id);
  }

  // Until nothing was seen twice yet; the workers keep up.
  void fly_up_to_the_loop(double drift) {
    for (angle_ = 0.0; angle_ < kBeforeLoop; angle_ += kStep) {
      add(angle_, drift);
      wait_until([this] { return unfinished_ == 0; });
    }
    ASSERT_TRUE(closer_->closed().empty());
  }

  // Until the loop is closed, and a bit further. While it is corrected keyframes are added as the solvers
  // want them.
  void fly_on(double drift) {
    for (; closed_ == 0 && angle_ < kBeforeLoop + 1.5; angle_ += kStep) {
      add(angle_, drift);
      wait_until([this] { return unfinished_ == 0 || added_ < wanted_ || closed_ > 0; });
    }
    for (std::size_t i = 0; i < kAdded; ++i, angle_ += kStep) add(angle_, drift);
    {
      const std::scoped_lock lock(state_mutex_);
      is_flying_ = false;
    }
    changed_.notify_all();
    mapping_->drain();
    closing_->drain();
    stop_readers();
  }

  void expect_loop_closed_while_the_map_grew() const {
    ASSERT_GE(closer_->closed().size(), 1U);
    EXPECT_EQ(closer_->refused(), 0U);
    EXPECT_EQ(map_.loops().size(), closer_->closed().size());
    EXPECT_GE(added_during_graph_, kAdded) << "keyframes added during pose graph optimisation";
    EXPECT_GE(added_during_bundle_, kAdded) << "keyframes added during global bundle adjustment";
    EXPECT_GT(reads_, 0U);
    EXPECT_EQ(not_finite_, 0U);
    EXPECT_EQ(torn_, 0U) << "poses of two states of the map in one reading";
  }

  // By how much the pose of a keyframe relative to another one is wrong, metres.
  double relative_error(KeyframeId a, KeyframeId b) const {
    const auto truth = [](KeyframeId id) {
      return WallFlight::on_ring(kStep * static_cast<double>(id.value));
    };
    const SE3 T_a_b = map_.T_camera_world(a) * map_.T_camera_world(b).inverse();
    return (T_a_b * (truth(a) * truth(b).inverse()).inverse()).translation().norm();
  }

  KeyframeId newest() const { return KeyframeId{static_cast<std::uint32_t>(flight_.flown() - 1)}; }

  WallFlight flight_{7};
  Map map_{{1.0F, 1.2F, 1.44F, 1.728F}};
  MapMutex mutex_;
  KeyframePoseTable poses_;
  std::optional<KeyframeDatabase> places_;
  std::optional<LoopCloser> closer_;
  double angle_ = 0.0;  // radians, of the next keyframe

 private:
  void wait_until(const std::function<bool()>& condition) {
    std::unique_lock lock(state_mutex_);
    changed_.wait(lock, [&] { return has_failed_ || condition(); });
  }

  // Lets nobody wait for a worker that has failed; the next call of it rethrows.
  void noting_failure(const std::function<void()>& work) {
    try {
      work();
    } catch (...) {
      {
        const std::scoped_lock lock(state_mutex_);
        has_failed_ = true;
      }
      changed_.notify_all();
      throw;
    }
  }

  void map_and_hand_on(KeyframeId id, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times) {
    map_keyframe_(id, should_stop, times);
    publish();
    closing_->submit(id);
  }

  // Counts the keyframes that are added until there are enough; the flight goes on meanwhile.
  void wait_for_keyframes(std::size_t& count) {
    std::unique_lock lock(state_mutex_);
    const std::size_t before = added_;
    wanted_ = before + kAdded;
    changed_.notify_all();
    changed_.wait(lock, [&] { return has_failed_ || !is_flying_ || added_ >= wanted_; });
    count = std::max(count, added_ - before);
  }

  // The work of the loop closer, whose solvers are made to wait once for keyframes that come meanwhile.
  void close(KeyframeId id, const KeyframeWorker::ShouldStop& should_stop, StageTimes&) {
    bool has_waited_in_graph = false;
    bool has_waited_in_bundle = false;
    closer_->process(
        id,
        [&] {
          if (!std::exchange(has_waited_in_bundle, true)) wait_for_keyframes(added_during_bundle_);
          return should_stop();
        },
        [&] {
          if (!std::exchange(has_waited_in_graph, true)) wait_for_keyframes(added_during_graph_);
          return closing_->is_cancelled();
        });
    publish();
    {
      const std::scoped_lock lock(state_mutex_);
      closed_ = closer_->closed().size();
      --unfinished_;
    }
    changed_.notify_all();
  }

  void publish() {
    const MapLock lock(mutex_, "test");
    poses_.publish(map_);
    // Of this state, or of one that was published later, are the poses of all these keyframes.
    published_ = map_.keyframe_slots();
    const std::scoped_lock state_lock(state_mutex_);
    ++version_;
    changed_.notify_all();
  }

  // Reads each time that something has changed.
  void read(const std::function<void()>& once) {
    std::size_t last = 0;
    while (true) {
      {
        std::unique_lock lock(state_mutex_);
        changed_.wait(lock, [&] { return is_stopped_ || version_ != last; });
        if (is_stopped_) return;
        last = version_;
      }
      once();
      ++reads_;
    }
  }

  // As the dense map and restoration do: without the map's mutex.
  void read_poses() {
    std::vector<KeyframeId> ids;
    const std::size_t count = published_;
    for (std::uint32_t i = 0; i < count; ++i) ids.push_back(KeyframeId{i});
    const auto poses = poses_.find(ids);
    for (std::size_t i = 0; i < count; ++i) {
      if (!poses[i].T_world_camera.is_finite()) ++not_finite_;
      if (i == 0) continue;
      const double step =
          (poses[i].T_world_camera.translation() - poses[i - 1].T_world_camera.translation()).norm();
      if (std::abs(step - kStepLength) > 0.15) ++torn_;
    }
  }

  // As the tracker does: the keyframes and landmarks around the newest one.
  void read_map() {
    const MapLock lock(mutex_, "test");
    if (map_.keyframe_slots() == 0) return;
    const KeyframeId newest{static_cast<std::uint32_t>(map_.keyframe_slots() - 1)};
    for (const auto& [id, shared] : map_.covisible(map_.T_camera_anchor(newest).first, 15)) {
      const Keyframe& keyframe = *map_.find(id);
      if (!keyframe.T_camera_world.is_finite()) ++not_finite_;
      for (const LandmarkId seen : keyframe.landmarks) {
        const Landmark* landmark = map_.find(seen);
        if (landmark != nullptr && !landmark->position.allFinite()) ++not_finite_;
      }
    }
  }

  void stop_readers() {
    {
      const std::scoped_lock lock(state_mutex_);
      is_stopped_ = true;
      is_flying_ = false;
    }
    changed_.notify_all();
    for (auto& reader : readers_) reader.join();
    readers_.clear();
  }

  KeyframeWorker::Work map_keyframe_;
  std::atomic<std::size_t> published_ = 0;  // keyframes whose poses are of one state of the map
  std::atomic<std::size_t> reads_ = 0;
  std::atomic<std::size_t> not_finite_ = 0;
  std::atomic<std::size_t> torn_ = 0;
  std::atomic<std::size_t> closed_ = 0;

  std::mutex state_mutex_;  // guards what follows; taken after the map's
  std::condition_variable changed_;
  std::size_t version_ = 0;     // of the map
  std::size_t added_ = 0;       // keyframes
  std::size_t wanted_ = 0;      // keyframes that the loop closer waits for
  std::size_t unfinished_ = 0;  // keyframes that the loop closer has not processed
  std::size_t added_during_graph_ = 0;
  std::size_t added_during_bundle_ = 0;
  bool has_failed_ = false;
  bool is_flying_ = true;
  bool is_stopped_ = false;

  std::vector<std::thread> readers_;
  std::optional<KeyframeWorker> closing_;  // last, so that the threads stop first
  std::optional<KeyframeWorker> mapping_;
};

TEST_F(RealTimeLoop, TakesTheDriftOutWhileTheMapGrows) {
  constexpr double kDrift = 0.004;
  // A mapper that changes landmarks only: it leaves the drift where it is.
  start(flight_.camera(), [this](KeyframeId id, const auto&, StageTimes&) {
    const MapLock lock(mutex_, "test");
    for (const LandmarkId landmark : map_.find(id)->landmarks) map_.refresh(landmark);
  });
  fly_up_to_the_loop(kDrift);
  const KeyframeId last = newest();
  const double drifted = flight_.error_of(map_, last);
  ASSERT_GT(drifted, 0.3);
  fly_on(kDrift);
  expect_loop_closed_while_the_map_grew();
  EXPECT_LT(flight_.error_of(map_, last), 0.1 * drifted);
  EXPECT_LT(flight_.mean_error(map_), 0.25 * drifted);
  // Also of the keyframes that came while the correction was computed.
  for (std::uint32_t i = last.value; i <= newest().value; ++i)
    EXPECT_LT(flight_.error_of(map_, KeyframeId{i}), 0.3 * drifted) << i;
}

// The mapper of the pipeline. Its bundle adjustment takes out the errors of odometry, so that the drift is
// that of a camera whose focal length is known to one percent only.
TEST_F(RealTimeLoop, ClosesALoopBesideTheMapper) {
  Camera camera = flight_.camera();
  camera.fx *= 1.01;
  camera.fy *= 1.01;
  LocalMapper mapper(camera, map_, mutex_, mapper_settings(Options()));
  start(camera,
        [&](KeyframeId id, const auto& should_stop, StageTimes&) { mapper.process(id, should_stop); });
  fly_up_to_the_loop(0.0);
  const double drifted = relative_error(newest(), KeyframeId{0});
  ASSERT_GT(drifted, 0.15);
  fly_on(0.0);
  expect_loop_closed_while_the_map_grew();
  const ClosedLoop& loop = closer_->closed().front();
  EXPECT_LT(relative_error(loop.keyframe, loop.matched_keyframe), 0.2 * drifted);
  for (std::uint32_t i = loop.keyframe.value; i <= newest().value; ++i)
    EXPECT_LT(relative_error(KeyframeId{i}, loop.matched_keyframe), 0.7 * drifted) << i;
}

}  // namespace
}  // namespace roslam::scene
