// SPDX-License-Identifier: BSD-3-Clause
// Frames of a camera that stalls, vanishes, comes back, jumps in time, and drops images.
#include "roslam/cameras/live_source.hpp"

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "roslam/common/error.hpp"
#include "tests/fake_camera.hpp"

namespace roslam {
namespace {

using std::chrono::milliseconds;
using Samples = std::vector<CameraSample>;

constexpr std::int64_t kInterval = 33'333'333;
constexpr int kSettling = 3;  // images after the first that show that the exposure is steady

class LiveSourceTest : public testing::Test {
 protected:
  LiveSourceTest() {
    device_.calibration = {fake_lens(), fake_lens(), SE3()};
    options_.silence = milliseconds(300);
    options_.retry = options_.after_reset = milliseconds(1);
  }

  std::unique_ptr<LiveSource> open() {
    return std::make_unique<LiveSource>(std::make_unique<FakeCamera>(device_), options_);
  }

  // A colour and a depth image; depth comes late_ms later.
  void give(std::uint64_t number, std::int64_t start = 0, int late_ms = 2, int brightness = 100) {
    const std::int64_t stamp = start + static_cast<std::int64_t>(number) * kInterval;
    give({fake_image(CameraStream::kColour, number, stamp, brightness),
          fake_image(CameraStream::kDepth, number, stamp + late_ms * kMillisecond,
                     1000 + static_cast<int>(number))});
  }
  void give(Samples samples) {
    device_.steps.emplace_back([samples = std::move(samples)] { return samples; });
  }
  void give_loss() {
    device_.steps.emplace_back([]() -> Samples { throw CameraLost("pulled out"); });
  }
  // Frames until nothing more comes.
  std::vector<Frame> frames_of(LiveSource& source) {
    std::vector<Frame> frames;
    device_.steps.emplace_back([&source]() -> Samples {
      source.interrupt();
      return {};
    });
    while (auto frame = source.next()) frames.push_back(std::move(*frame));
    return frames;
  }

  FakeDevice device_;
  LiveSourceOptions options_;
};

TEST_F(LiveSourceTest, GivesAFrameAsSoonAsItsImagesAreThere) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= kSettling + 1; ++i) give(i);
  const auto frame = source->next();  // does not need the images after it
  ASSERT_TRUE(frame);
  EXPECT_TRUE(device_.steps.empty());
  EXPECT_NEAR(frame->timestamp, (kSettling + 1) * kInterval * 1e-9, 1e-9);
  EXPECT_EQ(frame->colour.at<cv::Vec3b>(0, 0), cv::Vec3b(100, 100, 100));
  EXPECT_FLOAT_EQ(frame->depth.at<float>(5, 5), 1.0F + 0.001F * (kSettling + 1));
  EXPECT_TRUE(frame->received);
  EXPECT_TRUE(source->is_live());
  EXPECT_EQ(source->camera().fps, 30.0);
}

TEST_F(LiveSourceTest, LeavesOutImagesWhileTheExposureSettles) {
  const auto source = open();
  int brightness = 250;
  for (std::uint64_t i = 1; i <= 10; ++i, brightness -= 15) give(i, 0, 2, brightness);
  for (std::uint64_t i = 11; i <= 20; ++i) give(i, 0, 2, brightness);
  const auto frames = frames_of(*source);
  ASSERT_EQ(frames.size(), 10U - kSettling);
  EXPECT_EQ(frames.front().index, 0U);
  EXPECT_EQ(source->skipped().at("image while the exposure settles"), 10U + kSettling);
}

TEST_F(LiveSourceTest, DoesNotWaitForEverForExposure) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 40; ++i) give(i, 0, 2, i % 2 == 0 ? 200 : 20);  // a flickering lamp
  EXPECT_EQ(frames_of(*source).size(), 10U);
}

TEST_F(LiveSourceTest, RegistersDepthToColour) {
  Camera depth = fake_lens(48, 36, 40.0);
  device_.calibration.depth = depth;
  device_.calibration.T_colour_depth = SE3(Eigen::Quaterniond::Identity(), {0.02, 0.0, 0.0});
  const auto source = open();
  for (std::uint64_t i = 1; i <= 5; ++i)
    give({fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * kInterval, 100),
          fake_image(CameraStream::kDepth, i, static_cast<std::int64_t>(i) * kInterval, 2000, depth)});
  const auto frames = frames_of(*source);
  ASSERT_FALSE(frames.empty());
  const DepthRegistration registration(depth, fake_lens(), device_.calibration.T_colour_depth);
  const cv::Mat expected = registration(cv::Mat(36, 48, CV_32FC1, cv::Scalar(2.0)));
  EXPECT_EQ(cv::norm(frames.front().depth, expected, cv::NORM_INF), 0.0);
  EXPECT_EQ(frames.front().depth.size(), cv::Size(64, 48));
}

TEST_F(LiveSourceTest, CountsImagesThatTheDriverDropped) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 30; ++i)
    if (i % 3 != 0) give(i);
  EXPECT_EQ(frames_of(*source).size(), 20U - kSettling);
  EXPECT_EQ(source->notes().at("image that the camera or its driver dropped"), 2U * 9U);  // both streams
}

TEST_F(LiveSourceTest, KeepsColourWhoseDepthDoesNotCome) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 20; ++i)
    give({fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * kInterval, 100)});
  const auto frames = frames_of(*source);
  ASSERT_GE(frames.size(), 10U);
  for (const Frame& frame : frames) EXPECT_TRUE(frame.depth.empty());
  EXPECT_EQ(source->skipped_depth().at("no depth image near in time"), frames.size());
}

TEST_F(LiveSourceTest, PairsDepthWithTheNearestColour) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 20; ++i) give(i, 0, 18);  // ms, of 33: nearer to the next colour image
  std::size_t with_depth = 0;
  for (const Frame& frame : frames_of(*source)) {
    if (frame.depth.empty()) continue;
    ++with_depth;
    const double number = std::round(frame.timestamp * 1e9 / static_cast<double>(kInterval));
    EXPECT_NEAR(frame.depth.at<float>(5, 5) * 1000.0F - 1000.0F, number - 1.0, 0.01);
  }
  EXPECT_GE(with_depth, 14U);
}

TEST_F(LiveSourceTest, PassesOverImagesThatADriverGivesAgain) {
  const auto source = open();
  Samples last;
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * kInterval;
    const CameraSample colour = fake_image(CameraStream::kColour, i, stamp, 100),
                       depth = fake_image(CameraStream::kDepth, i, stamp + kMillisecond, 1000);
    Samples first{colour}, second{colour, depth};
    if (!last.empty()) first.push_back(last.back());  // with the depth image before
    give(first);
    give(second);
    last = second;
  }
  EXPECT_EQ(frames_of(*source).size(), 20U - kSettling);
  EXPECT_EQ(source->skipped().at("image while the exposure settles"), static_cast<std::size_t>(kSettling));
  EXPECT_EQ(source->skipped().size(), 1U);
  EXPECT_EQ(source->skipped_depth().size(), 1U);
  EXPECT_TRUE(source->notes().empty());
}

TEST_F(LiveSourceTest, KeepsAllImagesThatComeAtOnce) {
  const auto source = open();
  Samples all;
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * kInterval;
    all.push_back(fake_image(CameraStream::kColour, i, stamp, 100));
    all.push_back(fake_image(CameraStream::kDepth, i, stamp, 1000));
  }
  give(all);
  const auto frames = frames_of(*source);
  EXPECT_EQ(frames.size(), 20U - kSettling);
  for (const Frame& frame : frames) EXPECT_FALSE(frame.depth.empty());
}

TEST_F(LiveSourceTest, IsInterruptedWhileTheDriverHangs) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 5; ++i) give(i);
  give_loss();
  std::promise<void> go_on;
  const auto gone_on = go_on.get_future().share();
  device_.on_look = [gone_on] { gone_on.wait(); };
  EXPECT_TRUE(source->next());
  EXPECT_TRUE(source->next());
  std::jthread later([&] {
    std::this_thread::sleep_for(milliseconds(100));
    source->interrupt();
  });
  EXPECT_FALSE(source->next());  // else the test times out
  later.join();
  source->interrupt();
  EXPECT_FALSE(source->next());
  go_on.set_value();
}

TEST_F(LiveSourceTest, ComesBackWithItsClockAtZero) {
  const auto source = open();
  const std::int64_t noon = 1'700'000'000'000'000'000;
  for (std::uint64_t i = 1; i <= 10; ++i) give(i, noon);
  give_loss();
  for (std::uint64_t i = 1; i <= 10; ++i) give(i, 0);
  const auto frames = frames_of(*source);
  ASSERT_EQ(frames.size(), 2U * (10U - kSettling));
  EXPECT_EQ(frames.front().segment, 0);
  EXPECT_EQ(frames.back().segment, 1);
  EXPECT_LT(frames.back().timestamp, 1.0);
  for (const Frame& frame : frames) EXPECT_FALSE(frame.depth.empty());
  EXPECT_EQ(device_.attempts, 2);
  EXPECT_EQ(source->notes().at("the camera was lost"), 1U);
  EXPECT_EQ(source->notes().at("the camera was opened again"), 1U);
}

TEST_F(LiveSourceTest, ComesBackWithItsClockGoingOn) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 10; ++i) give(i);
  give_loss();
  for (std::uint64_t i = 101; i <= 110; ++i) give(i);
  const auto frames = frames_of(*source);
  ASSERT_EQ(frames.size(), 2U * (10U - kSettling));
  EXPECT_EQ(frames.back().segment, 0);
  EXPECT_GT(frames.back().timestamp, 3.0);
}

TEST_F(LiveSourceTest, WaitsForItsOwnCamera) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 5; ++i) give(i);
  // Another camera is plugged in meanwhile; only the fifth look finds the own one again.
  const DepthCameraDevice own = device_.devices.front(), other{"Fake D435", "9999", "", "3.2"};
  int looks = 0;
  device_.steps.emplace_back([&, this]() -> Samples {
    device_.devices = {other};
    device_.on_look = [&, this] {
      if (++looks == 5) device_.devices = {other, own};
    };
    throw CameraLost("pulled out");
  });
  for (std::uint64_t i = 11; i <= 15; ++i) give(i);
  EXPECT_EQ(frames_of(*source).size(), 2U * (5U - kSettling));
  EXPECT_EQ(looks, 5);
  EXPECT_EQ(device_.attempts, 2);  // never the other one
  EXPECT_EQ(device_.resets, 0);    // which would not help a camera that is not there
}

TEST_F(LiveSourceTest, ResetsTheHardwareAfterThreeFailures) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 5; ++i) give(i);
  give_loss();
  for (std::uint64_t i = 101; i <= 105; ++i) give(i);
  device_.steps[5] = [this]() -> Samples {
    device_.failing_opens = 1000;
    throw CameraLost("hangs");
  };
  device_.on_reset = [this] { device_.failing_opens = 0; };
  EXPECT_EQ(frames_of(*source).size(), 2U * (5U - kSettling));
  EXPECT_EQ(device_.resets, 1);
  EXPECT_EQ(device_.attempts, 1 + 3 + 1);
}

TEST_F(LiveSourceTest, OpensASilentCameraAgain) {
  options_.silence = milliseconds(100);
  const auto source = open();
  for (std::uint64_t i = 1; i <= 5; ++i) give(i);
  ASSERT_TRUE(source->next());
  ASSERT_TRUE(source->next());
  std::jthread later([this, &source] {
    std::this_thread::sleep_for(milliseconds(800));
    source->interrupt();
  });
  EXPECT_FALSE(source->next());
  EXPECT_GE(device_.attempts, 2);
  EXPECT_GE(source->notes().at("the camera was lost"), 1U);
}

TEST_F(LiveSourceTest, FallsBackToASlowerModeByUsb2) {
  device_.devices.front().usb = "2.1";
  const auto source = open();
  EXPECT_EQ(device_.opened.back().fps, 15);
  EXPECT_EQ(source->camera().fps, 15.0);
  EXPECT_EQ(source->notes().size(), 1U);
}

TEST_F(LiveSourceTest, FallsBackWhereTheModeDoesNotExist) {
  device_.fastest = 15;
  const auto source = open();
  EXPECT_EQ(device_.opened.back().fps, 15);
  device_.fastest = 5;
  EXPECT_THROW(open(), InputError);
}

TEST_F(LiveSourceTest, RefusesTwoClocksByName) {
  options_.first_image = milliseconds(100000);
  const auto source = open();
  for (std::uint64_t i = 1; i <= 2000; ++i) {
    device_.steps.emplace_back([i] {
      std::this_thread::sleep_for(milliseconds(2));
      const auto stamp = static_cast<std::int64_t>(i) * kInterval;
      Samples samples{fake_image(CameraStream::kColour, i, stamp, 100),
                      fake_image(CameraStream::kDepth, i, stamp, 1000)};
      samples.back().clock = "Hardware Clock";
      return samples;
    });
  }
  try {
    EXPECT_FALSE(source->next());
    FAIL() << "no error";
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("Hardware Clock"), std::string::npos) << what;
    EXPECT_NE(what.find("Global Time"), std::string::npos) << what;
  }
}

TEST_F(LiveSourceTest, TakesACameraThatGoesOverToAnotherClock) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * kInterval;
    const std::int64_t noon = 1'700'000'000'000'000'000;
    Samples samples{fake_image(CameraStream::kColour, i, i > 8 ? noon + stamp : stamp, 100),
                    fake_image(CameraStream::kDepth, i, i > 10 ? noon + stamp : stamp, 1000)};
    if (i <= 8) samples.front().clock = "Hardware Clock";
    if (i <= 10) samples.back().clock = "Hardware Clock";
    give(std::move(samples));
  }
  const auto frames = frames_of(*source);
  ASSERT_GE(frames.size(), 10U);
  EXPECT_GT(frames.back().timestamp, 1e9);
  EXPECT_FALSE(frames.back().depth.empty());
  EXPECT_EQ(frames.front().segment, 0);
  EXPECT_EQ(frames.back().segment, 1);
}

TEST_F(LiveSourceTest, NamesWhatIsConnected) {
  const auto message = [this] {
    try {
      open();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  device_.devices.push_back({"Fake D455", "5678", "", "2.1"});
  EXPECT_NE(message().find("5678"), std::string::npos) << message();
  options_.serial = "5678";
  EXPECT_EQ(message(), "no error");
  options_.serial = "0000";
  EXPECT_NE(message().find("1234"), std::string::npos) << message();
  device_.devices.clear();
  EXPECT_NE(message().find("no camera is connected"), std::string::npos) << message();
}

TEST_F(LiveSourceTest, GivesUpOnACameraThatIsUnpluggedBeforeItsFirstImage) {
  options_.first_image = milliseconds(200);
  const auto source = open();
  give_loss();
  device_.steps[0] = [this]() -> Samples {
    device_.devices.clear();
    throw CameraLost("pulled out");
  };
  try {
    source->next();
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("not connected"), std::string::npos) << error.what();
  }
}

TEST_F(LiveSourceTest, GivesUpOnACameraWithoutDepth) {
  options_.first_image = milliseconds(200);
  const auto source = open();
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    device_.steps.emplace_back([i] {
      std::this_thread::sleep_for(milliseconds(5));
      return Samples{fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * kInterval, 100)};
    });
  }
  try {
    while (source->next()) {
    }
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no depth image"), std::string::npos) << error.what();
  }
}

TEST_F(LiveSourceTest, OpensACameraAgainWhoseDepthHasStopped) {
  options_.silence = milliseconds(100);
  const auto source = open();
  for (std::uint64_t i = 1; i <= 8; ++i) give(i);
  for (std::uint64_t i = 9; i <= 60; ++i) {
    device_.steps.emplace_back([i] {
      std::this_thread::sleep_for(milliseconds(5));
      return Samples{fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * kInterval, 100)};
    });
  }
  EXPECT_GT(frames_of(*source).size(), 5U);
  EXPECT_GE(source->notes().at("the camera was lost"), 1U);
}

TEST_F(LiveSourceTest, IsInterruptedAtAnyPoint) {
  options_.silence = milliseconds(100000);
  options_.retry = milliseconds(100000);
  for (const bool is_lost : {false, true}) {
    const auto source = open();
    device_.steps.clear();
    if (is_lost) give_loss();
    std::stop_source stop;
    std::jthread later([&] {
      std::this_thread::sleep_for(milliseconds(50));
      stop.request_stop();
    });
    EXPECT_FALSE(source->next(stop.get_token()));  // else the test times out
  }
}

TEST_F(LiveSourceTest, JoinsInertialSamples) {
  device_.calibration.colour.imu = ImuCalibration{};
  const auto source = open();
  for (std::uint64_t i = 1; i <= 8; ++i) {
    const std::int64_t stamp = static_cast<std::int64_t>(i) * kInterval;
    Samples samples;
    for (int k = 3; k >= 0; --k) {
      CameraSample turn;
      turn.stream = CameraStream::kGyroscope;
      turn.stamp = stamp - k * 5 * kMillisecond;
      turn.clock = "Global Time";
      turn.vector = Eigen::Vector3d(0.1, 0.2, 0.3);
      CameraSample pull = turn;
      pull.stream = CameraStream::kAccelerometer;
      pull.vector = Eigen::Vector3d(0.0, -9.8, k);
      samples.push_back(pull);
      samples.push_back(turn);
    }
    samples.push_back(fake_image(CameraStream::kColour, i, stamp, 100));
    samples.push_back(fake_image(CameraStream::kDepth, i, stamp, 1000));
    give(std::move(samples));
  }
  const auto frames = frames_of(*source);
  ASSERT_EQ(frames.size(), 8U - kSettling);
  const auto& samples = frames.back().inertial;
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(samples.back().acceleration, Eigen::Vector3d(0.0, -9.8, 0.0));
  EXPECT_EQ(samples.front().turn_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_NEAR(samples.back().timestamp, frames.back().timestamp, 1e-9);
}

TEST_F(LiveSourceTest, PassesOverAnImageFromTheFuture) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 20; ++i) {
    auto stamp = static_cast<std::int64_t>(i) * kInterval;
    if (i == 10) stamp += 4'292'000'000'000;
    give(
        {fake_image(CameraStream::kColour, i, stamp, 100), fake_image(CameraStream::kDepth, i, stamp, 1000)});
  }
  const auto frames = frames_of(*source);
  ASSERT_GE(frames.size(), 19U - kSettling - 1U);
  EXPECT_LT(frames.back().timestamp, 1.0);
  EXPECT_EQ(frames.back().segment, 0);
}

TEST_F(LiveSourceTest, SkipsImagesOfAnotherSize) {
  const auto source = open();
  for (std::uint64_t i = 1; i <= 10; ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * kInterval;
    const Camera small = fake_lens(32, 24);
    give({fake_image(CameraStream::kColour, i, stamp, 100, i == 7 ? small : fake_lens()),
          fake_image(CameraStream::kDepth, i, stamp, 1000, i == 8 ? small : fake_lens())});
  }
  const auto frames = frames_of(*source);
  EXPECT_EQ(frames.size(), 9U - kSettling);
  EXPECT_EQ(source->skipped().at("colour image is not of 64x48 pixels"), 1U);
  EXPECT_EQ(source->skipped_depth().at("depth image is not of 64x48 pixels"), 1U);
}

TEST_F(LiveSourceTest, ChecksItsOptions) {
  for (const auto& spoil : std::vector<std::function<void(LiveSourceOptions&)>>{
           [](auto& o) { o.mode.fps = 0; }, [](auto& o) { o.mode.width = 1; },
           [](auto& o) { o.silence = milliseconds(0); }, [](auto& o) { o.retry = milliseconds(0); },
           [](auto& o) { o.attempts_before_reset = 0; }}) {
    LiveSourceOptions options;
    spoil(options);
    EXPECT_THROW(options.validate(), OptionsError);
  }
}

}  // namespace
}  // namespace roslam
