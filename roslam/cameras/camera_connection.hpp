// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/cameras/live_source_options.hpp"
#include "roslam/sensors/counts.hpp"

namespace roslam {

/// Keeps a camera open: finds it by its serial number, opens it, and opens it again when it was lost, for as
/// long as it takes. Drivers may need seconds for that, and do it on a thread of its own, so that waiting can
/// be interrupted. wait() and interrupt() may be called from two threads, the rest from that of wait().
class CameraConnection {
 public:
  /// Opens the camera. Throws InputError if there is none, or several and no serial number, or it does not
  /// start.
  CameraConnection(std::unique_ptr<DepthCamera> driver, const LiveSourceOptions& options);
  ~CameraConnection();

  const DepthCameraDevice& device() const { return device_; }
  const DepthCameraMode& mode() const { return mode_; }
  const DepthCameraCalibration& calibration() const { return calibration_; }

  /// Times that it was opened.
  int openings() const { return openings_; }

  /// What the camera gives within 0.1 s, or, while it is lost, nothing after an attempt to open it again.
  /// Nothing soon after interrupt().
  std::vector<CameraSample> wait();

  /// Closes the camera, to open it again.
  void lose(const std::string& why);

  /// Makes a wait() that waits, or is about to, return. Safe from any thread.
  void interrupt();

  /// Whether interrupt() was called since the last time.
  bool take_interrupt();

  /// What happened and how often, in words.
  const Counts& notes() const { return notes_; }

  /// Why the camera is not there, in words; empty: it never was lost.
  const std::string& why_lost() const { return why_lost_; }

 private:
  // What an attempt to open the camera has led to.
  struct Outcome {
    bool is_open = false, is_reset = false, is_there = false;
    DepthCameraDevice device;
    DepthCameraMode mode;
    std::string why;
  };

  DepthCameraDevice find() const;
  DepthCameraMode mode_for(const DepthCameraDevice& device) const;
  void open_first();
  Outcome attempt(bool resets) noexcept;
  void reconnect();
  void take(const Outcome& outcome);
  bool pause(std::chrono::milliseconds duration);

  std::unique_ptr<DepthCamera> driver_;  // used by worker_ while the camera is lost
  LiveSourceOptions options_;
  DepthCameraDevice device_;
  DepthCameraMode mode_;
  DepthCameraCalibration calibration_;
  bool is_open_ = false, was_reset_ = false;
  int openings_ = 0, failures_ = 0;
  std::string why_lost_;
  Counts notes_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool is_interrupted_ = false;     // guarded by mutex_
  std::optional<Outcome> outcome_;  // of worker_, likewise
  std::jthread worker_;             // makes one attempt
};

}  // namespace roslam
