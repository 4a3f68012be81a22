// SPDX-License-Identifier: BSD-3-Clause
// A flight with a camera that stalls, drops images, and comes back with its clock at zero.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "roslam/cameras/live_source.hpp"
#include "roslam/options/options.hpp"
#include "roslam/slam/run.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/fake_camera.hpp"

namespace roslam {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kFrames = 90;
constexpr std::size_t kStall = 40, kLoss = 65;  // frames before which the camera stalls, is pulled out

Options flight_options() {
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  options.dense.enabled = false;
  return options;
}

// The images of a simulated flight as a camera gives them.
class Flight {
 public:
  Flight() : source_(options()) {
    device_.calibration = {source_.camera(), source_.camera(), SE3()};
    device_.calibration.colour.depth_units_per_metre = 1000.0;
  }

  // One image each time it is asked for, at a fifth of the rate of the flight, so that none is late.
  void give(std::size_t index, std::int64_t stamp) {
    device_.steps.emplace_back([this, index, stamp]() -> std::vector<CameraSample> {
      std::this_thread::sleep_for(milliseconds(60));
      while (next_ && next_->index < index) next_ = source_.next();
      if (!next_) return {};
      Camera camera = source_.camera();
      CameraSample colour = fake_image(CameraStream::kColour, index + 1, stamp, 0, camera);
      CameraSample depth = fake_image(CameraStream::kDepth, index + 1, stamp, 0, camera);
      colour.pixels = next_->colour.clone();
      next_->depth.convertTo(depth.pixels, CV_16UC1, 1000.0);
      return {colour, depth};
    });
  }

  void stall(milliseconds duration) {
    for (milliseconds passed(0); passed < duration; passed += milliseconds(100)) {
      device_.steps.emplace_back([]() -> std::vector<CameraSample> {
        std::this_thread::sleep_for(milliseconds(100));
        return {};
      });
    }
  }

  // The camera is pulled out; it is there again at once, or never.
  void lose(bool comes_back) {
    device_.steps.emplace_back([this, comes_back]() -> std::vector<CameraSample> {
      if (!comes_back) device_.devices.clear();
      throw CameraLost("pulled out");
    });
  }

  FakeDevice& device() { return device_; }

 private:
  static simulation::SimulatorOptions options() {
    simulation::SimulatorOptions options;
    options.path = simulation::FlightPath::kStreet;
    options.traffic = simulation::TrafficLevel::kNone;
    options.frames = kFrames;
    return options;
  }

  simulation::SimulatedSource source_;
  std::optional<Frame> next_ = source_.next();
  FakeDevice device_;
};

TEST(LiveFlight, GoesOnWhenTheCameraStallsAndComesBack) {
  Flight flight;
  constexpr std::int64_t kInterval = 33'333'333, kNoon = 1'700'000'000'000'000'000;
  for (std::size_t i = 0; i < kFrames; ++i) {
    if (i == kStall) flight.stall(milliseconds(2000));
    if (i == kLoss) flight.lose(true);
    if (i % 3 == 2) continue;  // the driver drops it
    // The stall is on the camera's clock as well; after the loss that begins at zero.
    const auto since = static_cast<std::int64_t>(i) * kInterval;
    flight.give(i, i >= kLoss ? since : kNoon + since + (i >= kStall ? 2'000'000'000 : 0));
  }
  LiveSourceOptions options;
  options.retry = milliseconds(10);
  LiveSource source(std::make_unique<FakeCamera>(flight.device()), options);
  std::stop_source stop;
  flight.device().steps.emplace_back([&]() -> std::vector<CameraSample> {
    std::this_thread::sleep_for(milliseconds(500));  // the last frames are tracked meanwhile
    stop.request_stop();
    return {};
  });
  Slam slam(source.camera(), flight_options(), Mode::kRealTime);
  std::vector<FrameResult> results;
  const RunSummary summary = run_slam(
      source, slam, [&](const Frame&, const FrameResult& result) { results.push_back(result); },
      stop.get_token());
  EXPECT_FALSE(summary.failure);
  EXPECT_TRUE(summary.interrupted);
  EXPECT_EQ(source.notes().at("the camera was lost"), 1U);
  EXPECT_EQ(source.notes().at("the camera was opened again"), 1U);
  EXPECT_GT(source.notes().at("image that the camera or its driver dropped"), 20U);
  std::size_t before = 0, between = 0, after = 0;  // poses before the stall, before the loss, after it
  std::optional<Odometry> last;
  for (const FrameResult& result : results) {
    if (result.T_world_camera) {
      const bool is_after = result.timestamp < 1e6;
      const bool is_between = result.timestamp > 1.7e9 + 2.0 + kStall / 30.0 - 0.1;
      ++(is_after ? after : is_between ? between : before);
    }
    if (!result.odometry) continue;
    // The drone flies at 1 m/s: without a reset the pose does not jump by more than the time allows.
    if (last && last->resets == result.odometry->resets) {
      const double time = result.odometry->timestamp - last->timestamp;
      const double step =
          (result.odometry->T_odom_body.translation() - last->T_odom_body.translation()).norm();
      EXPECT_LT(step, 0.1 + 2.0 * std::abs(time)) << result.odometry->timestamp;
    }
    last = result.odometry;
  }
  EXPECT_GT(before, 10U);
  EXPECT_GT(between, 5U);
  EXPECT_GT(after, 5U);
  ASSERT_TRUE(last);
  EXPECT_GE(last->resets, 1U);  // the clock began anew
}

// Wherever the camera hangs, a stop ends the flight.
TEST(LiveFlight, EndsSoonAfterAStop) {
  for (const bool is_lost : {false, true}) {
    Flight flight;
    for (std::size_t i = 0; i < 12; ++i) flight.give(i, static_cast<std::int64_t>(i + 1) * 33'333'333);
    if (is_lost) flight.lose(false);
    LiveSourceOptions options;
    options.silence = milliseconds(60000);
    LiveSource source(std::make_unique<FakeCamera>(flight.device()), options);
    Slam slam(source.camera(), flight_options(), Mode::kRealTime);
    std::stop_source stop;
    Clock::time_point stopped;
    std::jthread later([&] {
      std::this_thread::sleep_for(milliseconds(1500));
      stopped = Clock::now();
      stop.request_stop();
    });
    const RunSummary summary = run_slam(source, slam, {}, stop.get_token());
    later.join();
    EXPECT_TRUE(summary.interrupted);
    EXPECT_LT(Clock::now() - stopped, std::chrono::seconds(10));  // 60 s if it were not interrupted
  }
}

}  // namespace
}  // namespace roslam
