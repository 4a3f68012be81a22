// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/cameras/exposure_settling.hpp"
#include "roslam/cameras/live_source_options.hpp"
#include "roslam/common/export.hpp"
#include "roslam/sensors/counts.hpp"
#include "roslam/sensors/depth_registration.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/sensors/inertial_queue.hpp"
#include "roslam/sensors/missing_depth.hpp"
#include "roslam/sensors/stream_pairing.hpp"

namespace roslam {

class CameraConnection;

/// Frames of a camera that is connected. Colour and depth images are paired by their time stamps, within half
/// a frame, and depth is registered to colour. A camera that is lost is opened again by its serial number,
/// for as long as it takes; its clock may begin anew, which begins a new segment. The first images after the
/// camera was opened, while its exposure settles, are left out.
///
/// next() and interrupt() may be called from two threads, the rest from that of next().
class ROSLAM_EXPORT LiveSource : public FrameSource {
 public:
  /// Opens the camera. T_body_camera: the mount. Throws InputError if there is no camera, or several and no
  /// serial number, or it does not start; CalibrationError if its calibration cannot be.
  LiveSource(std::unique_ptr<DepthCamera> camera, const LiveSourceOptions& options,
             const std::optional<SE3>& T_body_camera = {});
  ~LiveSource() override;

  /// Calls a function with each sample that is used, on the thread of next(), such as to record it. What it
  /// uses must outlive the source, or be taken away by an empty function. Not while next() runs.
  void on_sample(std::function<void(const CameraSample&)> function) { on_sample_ = std::move(function); }

  /// Also throws InputError if no colour or no depth image comes at all, or the two are stamped by different
  /// clocks.
  std::optional<Frame> next() override;
  using FrameSource::next;
  void interrupt() override;
  bool is_live() const override { return true; }
  const Camera& camera() const override { return calibration_.colour; }

  Counts skipped() const override;
  Counts skipped_depth() const override;
  Counts notes() const override;

  const DepthCameraDevice& device() const;
  const DepthCameraCalibration& calibration() const { return calibration_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Pairing = StreamPairing<CameraSample>;

  void begin_opening();
  void receive();
  void require_images() const;
  void take(CameraSample sample);
  void take_inertial(const CameraSample& sample);
  bool is_repeated(const CameraSample& sample);
  bool has_right_pixels(const CameraSample& sample);
  bool is_of_one_clock(const CameraSample& sample);
  Frame frame_of(Pairing::Pair images);

  std::unique_ptr<CameraConnection> connection_;
  LiveSourceOptions options_;
  std::function<void(const CameraSample&)> on_sample_;
  DepthCameraCalibration calibration_;
  DepthRegistration registration_;
  Pairing pairing_;
  InertialQueue inertial_;
  ExposureSettling settling_;
  std::deque<CameraSample> received_;  // and not yet used

  bool has_frame_ = false, has_depth_ = false;
  int openings_ = 0;
  Clock::time_point created_, last_colour_, last_depth_, clocks_agreed_;
  std::map<CameraStream, std::pair<std::uint64_t, std::int64_t>> last_;  // number and stamp of the last image
  std::map<CameraStream, std::string> clocks_;                           // that stamped it
  std::string clock_;                                                    // of both, of the last frame
  Counts skipped_, skipped_depth_, notes_;
  MissingDepth missing_depth_;
};

}  // namespace roslam
