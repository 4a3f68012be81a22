// SPDX-License-Identifier: BSD-3-Clause
// What is recorded of a camera or a flight gives the same frames and the same trajectory again.
#include "roslam/cameras/camera_recorder.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "roslam/cameras/live_source.hpp"
#include "roslam/common/error.hpp"
#include "roslam/options/options.hpp"
#include "roslam/ros/recording_source.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/fake_camera.hpp"
#include "tests/file_size_limit.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFlight = 25;  // frames

// Seeded, so that images differ.
cv::Mat noise(const Camera& camera, int type, int seed) {
  cv::Mat image(camera.height, camera.width, type);
  cv::RNG(static_cast<std::uint64_t>(seed)).fill(image, cv::RNG::UNIFORM, 90, 110);
  return image;
}

FakeDevice recorded_device() {
  FakeDevice device;
  device.calibration = {
      fake_lens(), fake_lens(48, 36, 40.0),
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())), {0.015, 1e-4, 2e-4})};
  Camera& lens = device.calibration.colour;
  lens.set_lens("pinhole", {-0.0565363, 0.0682019, 0.000366, 0.000693, -0.0218432});
  lens.imu = ImuCalibration{};
  lens.imu->T_camera_imu = SE3(Eigen::Quaterniond::Identity(), {0.02, -0.01, 0.005});
  lens.depth_units_per_metre = 10000.0;
  for (std::uint64_t i = 1; i <= 40; ++i) {
    device.steps.emplace_back([i, calibration = device.calibration]() -> std::vector<CameraSample> {
      if (i == 25) throw CameraLost("pulled out");  // and comes back with its clock at zero
      const std::int64_t start = i < 25 ? 1'700'000'000'000'000'000 : 0;
      const std::int64_t stamp = start + static_cast<std::int64_t>(i) * 33'333'333;
      CameraSample colour = fake_image(CameraStream::kColour, i, stamp, 100, calibration.colour);
      CameraSample depth =
          fake_image(CameraStream::kDepth, i, stamp + 3 * kMillisecond, 1000, calibration.depth);
      colour.pixels = noise(calibration.colour, CV_8UC3, static_cast<int>(i));
      depth.pixels = 150 * noise(calibration.depth, CV_16UC1, static_cast<int>(i));
      CameraSample turn;
      turn.stream = CameraStream::kGyroscope;
      turn.stamp = stamp - 4 * kMillisecond;
      turn.clock = colour.clock;
      turn.received = colour.received;
      turn.vector = Eigen::Vector3d(0.01, 0.02, 0.001 * static_cast<double>(i));
      CameraSample pull = turn;
      pull.stream = CameraStream::kAccelerometer;
      std::vector<CameraSample> samples{pull, turn, colour};
      if (i % 7 != 0) samples.push_back(depth);
      return samples;
    });
  }
  return device;
}

TEST(CameraRecorder, ALiveCameraIsReadBackFrameByFrame) {
  const fs::path file = scratch_path(".mcap");
  FakeDevice device = recorded_device();
  std::vector<Frame> live;
  {
    LiveSourceOptions options;
    options.retry = std::chrono::milliseconds(1);
    LiveSource source(std::make_unique<FakeCamera>(device), options);
    CameraRecorder recorder(file, source.calibration());
    source.on_sample([&](const CameraSample& sample) { recorder.add(sample); });
    device.steps.emplace_back([&]() -> std::vector<CameraSample> {
      source.interrupt();
      return {};
    });
    while (auto frame = source.next()) live.push_back(std::move(*frame));
    recorder.close();
    EXPECT_EQ(recorder.lost(), 0U);
    EXPECT_EQ(recorder.bytes(), fs::file_size(file));
  }
  ASSERT_GE(live.size(), 30U);
  RecordingSource recorded(file, {}, std::nullopt);
  EXPECT_EQ(recorded.camera().fx, device.calibration.colour.fx);
  EXPECT_EQ(recorded.camera().distortion, device.calibration.colour.distortion);
  EXPECT_EQ(recorded.camera().depth_units_per_metre, 10000.0);
  EXPECT_EQ(recorded.camera().fps, 30.0);
  for (const Frame& expected : live) {
    const auto frame = recorded.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->timestamp, expected.timestamp);
    EXPECT_EQ(frame->segment, expected.segment);
    EXPECT_EQ(frame->index, expected.index);
    EXPECT_EQ(cv::norm(frame->colour, expected.colour, cv::NORM_INF), 0.0);
    ASSERT_EQ(frame->depth.empty(), expected.depth.empty());
    if (!frame->depth.empty()) {
      EXPECT_EQ(cv::norm(frame->depth, expected.depth, cv::NORM_INF), 0.0);
    }
    ASSERT_EQ(frame->inertial.size(), expected.inertial.size())
        << expected.timestamp << " " << expected.index;
    for (std::size_t k = 0; k < frame->inertial.size(); ++k) {
      EXPECT_EQ(frame->inertial[k].timestamp, expected.inertial[k].timestamp);
      EXPECT_EQ(frame->inertial[k].turn_rate, expected.inertial[k].turn_rate);
    }
  }
}

// The trajectory of a source, and what it knew.
Trajectory flown(FrameSource& source) {
  Options options;
  options.dynamic_objects = *options_of_mode("geometry", options.dynamic_objects);
  options.dense.enabled = false;
  Slam slam(source.camera(), options);
  while (const auto frame = source.next()) slam.process(*frame);
  slam.finish();
  return slam.trajectory();
}

TEST(CameraRecorder, ASimulatedFlightIsRepeatedBitForBit) {
  for (const bool has_imu : {false, true}) {
    simulation::SimulatorOptions options;
    options.path = simulation::FlightPath::kHover;
    options.frames = kFlight;
    options.imu = has_imu;
    const fs::path file = scratch_path(".mcap");
    {
      simulation::SimulatedSource source(options);
      CameraRecorderOptions recording;
      recording.waits_for_disk = true;
      CameraRecorder recorder(file, {source.camera(), source.camera(), SE3()}, recording);
      while (const auto frame = source.next()) recorder.add(*frame);
      recorder.close();
    }
    simulation::SimulatedSource source(options);
    RecordingSource recorded(file, {}, std::nullopt);
    EXPECT_EQ(recorded.size(), kFlight);
    const Trajectory expected = flown(source), trajectory = flown(recorded);
    ASSERT_EQ(expected.size(), kFlight);
    ASSERT_EQ(trajectory.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(trajectory[i].timestamp, expected[i].timestamp);
      EXPECT_EQ(trajectory[i].T_world_camera.matrix(), expected[i].T_world_camera.matrix()) << i;
    }
  }
}

TEST(CameraRecorder, TellsThatTheDiskIsFullAndKeepsWhatWasWritten) {
  const fs::path file = scratch_path(".mcap");
  const DepthCameraCalibration calibration{fake_lens(), fake_lens(), SE3()};
  {
    const FileSizeLimit full(200000);
    CameraRecorderOptions options;
    options.waits_for_disk = true;
    options.chunk_bytes = 20000;
    options.compresses = false;
    CameraRecorder recorder(file, calibration, options);
    for (std::uint64_t i = 1; i <= 100; ++i)
      recorder.add(fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * 33'333'333, 100));
    EXPECT_THROW(recorder.close(), OutputError);
    EXPECT_TRUE(recorder.has_failed());
  }
  EXPECT_GT(read_all(*open_recording(file)).size(), 20U);
}

TEST(CameraRecorder, LosesWhatHasNoRoomAndCountsIt) {
  CameraRecorderOptions options;
  options.waiting_bytes = 20000;  // two images
  CameraRecorder recorder(scratch_path(".mcap"), {fake_lens(), fake_lens(), SE3()}, options);
  for (std::uint64_t i = 1; i <= 2000; ++i)
    recorder.add(fake_image(CameraStream::kColour, i, static_cast<std::int64_t>(i) * 33'333'333, 100));
  EXPECT_GT(recorder.lost(), 0U);
  EXPECT_FALSE(recorder.has_failed());
  recorder.close();
}

TEST(CameraRecorder, RefusesAFileThatCannotBe) {
  EXPECT_THROW(CameraRecorder("/nowhere/flight.mcap", {fake_lens(), fake_lens(), SE3()}), OutputError);
}

}  // namespace
}  // namespace roslam
