// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "roslam/cameras/depth_camera.hpp"

namespace roslam {

/// What a FakeCamera does and what was asked of it; shared with the test, which outlives it.
struct FakeDevice {
  /// What wait() gives, one after the other; it may throw CameraLost. Nothing comes once they are used up.
  std::deque<std::function<std::vector<CameraSample>()>> steps;
  std::vector<DepthCameraDevice> devices{{"Fake D435", "1234", "5.13", "3.2"}};
  int failing_opens = 0;  ///< that throw CameraLost from now on
  int fastest = 60;       ///< images a second; faster modes do not exist
  DepthCameraCalibration calibration;
  std::vector<DepthCameraMode> opened;  ///< modes
  int attempts = 0;                     ///< to open it
  int resets = 0;
  int closes = 0;
  std::function<void()> on_reset = [] {};
  std::function<void()> on_look = [] {};  ///< when it is asked for its devices
};

/// A camera of which the test tells what it gives.
class FakeCamera : public DepthCamera {
 public:
  explicit FakeCamera(FakeDevice& device) : device_(device) {}

  std::string kind() const override { return "fake"; }
  std::vector<DepthCameraDevice> devices() override {
    device_.on_look();
    return device_.devices;
  }
  DepthCameraCalibration calibration() const override { return device_.calibration; }

  void open(const std::string& serial, const DepthCameraMode& mode) override {
    ++device_.attempts;
    bool is_there = false;
    for (const auto& device : device_.devices) is_there |= device.serial == serial;
    if (!is_there || device_.failing_opens > 0) {
      --device_.failing_opens;
      throw CameraLost("the fake camera does not start");
    }
    if (mode.fps > device_.fastest) throw InputError("the fake camera has no such mode");
    device_.opened.push_back(mode);
  }

  std::vector<CameraSample> wait(std::chrono::milliseconds at_most) override {
    if (device_.steps.empty()) {
      std::this_thread::sleep_for(at_most);
      return {};
    }
    const auto step = std::move(device_.steps.front());
    device_.steps.pop_front();
    return step();
  }

  void reset(const std::string& /*serial*/) override {
    ++device_.resets;
    device_.on_reset();
  }

  void close() noexcept override { ++device_.closes; }

 private:
  FakeDevice& device_;
};

inline Camera fake_lens(int width = 64, int height = 48, double focal = 60.0) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal;
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  camera.depth_units_per_metre = 1000.0;
  return camera;
}

constexpr std::int64_t kMillisecond = 1'000'000;  // nanoseconds

/// An image of a stream. value: brightness, or millimetres, of all pixels.
inline CameraSample fake_image(CameraStream stream, std::uint64_t number, std::int64_t stamp, int value,
                               const Camera& camera = fake_lens()) {
  CameraSample sample;
  sample.stream = stream;
  sample.stamp = stamp;
  sample.clock = "Global Time";
  sample.number = number;
  sample.pixels = stream == CameraStream::kDepth
                      ? cv::Mat(camera.height, camera.width, CV_16UC1, cv::Scalar(value))
                      : cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar::all(value));
  return sample;
}

}  // namespace roslam
