// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/cameras/exposure_settling.hpp"
#include "roslam/common/export.hpp"
#include "roslam/sensors/counts.hpp"
#include "roslam/sensors/depth_registration.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/sensors/inertial_queue.hpp"
#include "roslam/sensors/missing_depth.hpp"
#include "roslam/sensors/stream_pairing.hpp"

namespace roslam {

struct ROSLAM_EXPORT LiveSourceOptions {
  std::string serial;    ///< of the camera; empty: the only one that is connected
  DepthCameraMode mode;  ///< that is asked for; by USB 2 at most 15 images a second
  std::chrono::milliseconds silence{
      3000};  ///< without any image, after which the camera counts as lost; >= 100
  std::chrono::milliseconds retry{1000};  ///< between two attempts to open a camera that was lost; >= 1
  int attempts_before_reset = 3;          ///< that fail, after which the hardware is reset; >= 1
  std::chrono::milliseconds first_image{
      20000};  ///< to wait for the first image of all, then to give up; >= 100

  /// Throws OptionsError.
  void validate() const;
};

/// Frames of a camera that is connected. Colour and depth images are paired by their time stamps, within half
/// a frame, and depth is registered to colour. A camera that is lost is opened again by its serial number,
/// for as long as it takes; its clock may begin anew, which begins a new segment. The first images after the
/// camera was opened, while its exposure settles, are left out.
///
/// next() and interrupt() may be called from two threads, the rest from that of next().
class ROSLAM_EXPORT LiveSource : public FrameSource {
 public:
  /// Opens the camera. T_body_camera: the mount. Throws InputError if there is no camera, or several and no
  /// serial number, or it does not start.
  LiveSource(std::unique_ptr<DepthCamera> camera, const LiveSourceOptions& options,
             const std::optional<SE3>& T_body_camera = {});
  ~LiveSource() override;

  /// Calls a function with each sample that is used, on the thread of next(), such as to record it. To be set
  /// before the first next().
  void on_sample(std::function<void(const CameraSample&)> function) { on_sample_ = std::move(function); }

  /// Also throws InputError if no image comes at all, or colour and depth are stamped by different clocks.
  std::optional<Frame> next() override;
  using FrameSource::next;
  void interrupt() override;
  bool is_live() const override { return true; }
  const Camera& camera() const override { return calibration_.colour; }

  std::map<std::string, std::size_t> skipped() const override;
  std::map<std::string, std::size_t> skipped_depth() const override;
  std::map<std::string, std::size_t> notes() const override { return notes_; }

  const DepthCameraDevice& device() const { return device_; }
  const DepthCameraCalibration& calibration() const { return calibration_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Pairing = StreamPairing<CameraSample>;

  DepthCameraDevice find_device() const;
  void open();
  void open_in(DepthCameraMode mode);
  void lose(const std::string& why);
  void come_back();
  void require_images() const;
  bool pause(std::chrono::milliseconds duration);
  bool take_interrupt();
  void receive();
  void take(CameraSample sample);
  void take_inertial(const CameraSample& sample);
  bool is_of_one_clock(const CameraSample& sample);
  void count_missing(const CameraSample& sample);
  std::optional<Frame> frame_of(Pairing::Pair images);
  cv::Mat registered(const cv::Mat& raw);

  std::unique_ptr<DepthCamera> driver_;
  LiveSourceOptions options_;
  std::function<void(const CameraSample&)> on_sample_;
  std::optional<SE3> T_body_camera_;
  DepthCameraDevice device_;
  DepthCameraCalibration calibration_;
  std::optional<DepthRegistration> registration_;
  Pairing pairing_;
  MissingDepth missing_depth_;
  InertialQueue inertial_;
  ExposureSettling settling_;

  bool is_open_ = false, has_frame_ = false;
  Clock::time_point created_, opened_, last_image_;
  int failed_attempts_ = 0;
  std::string why_lost_;
  std::map<CameraStream, std::uint64_t> numbers_;  // of the last image of each stream
  std::map<CameraStream, std::string> clocks_;     // likewise
  Counts skipped_, skipped_depth_, notes_;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool is_interrupted_ = false;  // guarded by mutex_
};

}  // namespace roslam
