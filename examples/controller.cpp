// SPDX-License-Identifier: BSD-3-Clause
// A controller that holds a position by the poses of RO-SLAM: a callback takes each pose, a loop at 50 Hz
// makes a velocity command of the newest. Here a recording takes the place of the camera, and the command is
// printed in place of being sent.
#include <atomic>
#include <chrono>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/slam/open_slam.hpp"
#include "roslam/slam/run.hpp"

namespace {

using Clock = std::chrono::steady_clock;

// The newest pose, and when its image was received: shared by the callback and the controller.
class NewestPose {
 public:
  void set(const roslam::FrameResult& result) {
    const std::scoped_lock lock(mutex_);
    odometry_ = result.odometry;
    received_ = result.received;
    if (!result.odometry) std::cerr << "no pose: " << roslam::describe(result.no_pose) << "\n";
  }

  // Nothing where there is none, or where it is too old to be flown by.
  std::optional<roslam::Odometry> get() const {
    const std::scoped_lock lock(mutex_);
    constexpr auto kOldest = std::chrono::milliseconds(200);
    return Clock::now() - received_ < kOldest ? odometry_ : std::nullopt;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<roslam::Odometry> odometry_;
  Clock::time_point received_;
};

class PositionHold {
 public:
  // The velocity (m/s, body frame) that leads back to where the hold began.
  std::optional<Eigen::Vector3d> command(const std::optional<roslam::Odometry>& odometry) {
    // A predicted pose is a guess. After a reset the old target has no meaning any more.
    if (!odometry || odometry->is_predicted) return std::nullopt;
    if (!target_ || odometry->resets != resets_) target_ = odometry->T_odom_body.translation();
    resets_ = odometry->resets;
    constexpr double kGain = 0.8, kDamping = 0.3;                              // 1/s, 1
    const Eigen::Vector3d error = odometry->T_odom_body.inverse() * *target_;  // in the body frame
    return kGain * error - kDamping * odometry->linear_velocity;
  }

 private:
  std::optional<Eigen::Vector3d> target_;
  std::size_t resets_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: controller TUM_FOLDER CAMERA (a preset such as tum-fr1, or a YAML file)\n";
    return 2;
  }
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  NewestPose newest;  // before slam, whose callbacks use it to the end
  const auto slam = roslam::open_slam(source.camera(), {}, roslam::Mode::kRealTime);
  slam->on_frame([&](const roslam::FrameResult& result) { newest.set(result); });
  std::jthread controller([&](const std::stop_token& stop) {
    PositionHold hold;
    for (auto next = Clock::now(); !stop.stop_requested(); std::this_thread::sleep_until(next)) {
      next += std::chrono::milliseconds(20);
      if (const auto velocity = hold.command(newest.get())) std::cout << velocity->transpose() << "\n";
    }
  });
  roslam::run_slam(source, *slam);
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
