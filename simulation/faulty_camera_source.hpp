// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/sensors/depth_registration.hpp"
#include "simulation/wrapped_source.hpp"

namespace roslam::simulation {

/// What is often wrong with a camera file or a recording.
enum class CameraFault {
  kDepthTooLarge,      ///< depth is five times too large
  kDepthTooSmall,      ///< a fifth of what it is
  kShiftedDepth,       ///< depth of a camera of the same focal length, 5 cm beside
  kPlainDepth,         ///< depth of a camera 1.5 cm beside whose focal length is 390/613, as of a D435
  kDistorted,          ///< images of a lens with distortion, which the camera file has: no fault
  kNoDistortion,       ///< the same, but the camera file lacks it
  kInverseDistortion,  ///< the same, but the camera file has the opposite sign
  kLateDepth,          ///< depth comes two frames late
  kEarlyDepth,         ///< colour comes two frames late
};

/// "depth-too-large" and so on.
std::string_view name_of(CameraFault fault);
std::optional<CameraFault> camera_fault_from(std::string_view name);
std::vector<std::string> camera_fault_names();

/// A source to which faults of a camera are added, to test what should find them. Of a source whose camera
/// has distortion, kNoDistortion and kInverseDistortion change the camera alone; else the images are
/// distorted too.
class FaultyCameraSource : public WrappedSource {
 public:
  FaultyCameraSource(std::unique_ptr<FrameSource> source, const std::vector<CameraFault>& faults);

  std::optional<Frame> next() override;
  const Camera& camera() const override { return camera_; }

 private:
  void set_lens(CameraFault fault);
  void set_depth_camera(double focal_ratio, double beside);

  std::unique_ptr<FrameSource> owned_;
  Camera camera_;
  double depth_factor_ = 1.0;
  std::size_t depth_delay_ = 0, colour_delay_ = 0;  // frames
  std::unique_ptr<DepthRegistration> to_depth_camera_;
  cv::Mat pixels_;  // CV_32FC2, of the source, for each pixel of the distorted image; or empty
  std::deque<cv::Mat> colours_, depths_;
};

}  // namespace roslam::simulation
