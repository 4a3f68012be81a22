// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// A camera that is connected.
struct ROSLAM_EXPORT DepthCameraDevice {
  std::string name, serial, firmware;
  std::string usb;  ///< version of the connection, such as "3.2"; empty: not known

  bool is_usb2() const { return usb.starts_with("2"); }
};

/// "Intel RealSense D435 (1234, USB 3.2)".
inline std::string in_words(const DepthCameraDevice& device) {
  return device.name + " (" + device.serial + (device.usb.empty() ? "" : ", USB " + device.usb) + ")";
}

/// The images that are asked for; of colour and depth alike.
struct ROSLAM_EXPORT DepthCameraMode {
  int width = 640, height = 480;  ///< pixels
  int fps = 30;                   ///< images a second

  bool operator==(const DepthCameraMode&) const = default;
};

/// "640x480 at 30 a second".
inline std::string in_words(const DepthCameraMode& mode) {
  return std::to_string(mode.width) + "x" + std::to_string(mode.height) + " at " + std::to_string(mode.fps) +
         " a second";
}

/// As the device knows it.
struct ROSLAM_EXPORT DepthCameraCalibration {
  Camera colour;  ///< with the depth units, the rate, and the inertial unit if it has one
  Camera depth;
  SE3 T_colour_depth;
};

enum class CameraStream { kColour, kDepth, kAccelerometer, kGyroscope };

/// What a stream of a camera gives at one time.
struct ROSLAM_EXPORT CameraSample {
  CameraStream stream = CameraStream::kColour;
  std::int64_t stamp = 0;    ///< ns, of the middle of the exposure where it is known
  std::string clock;         ///< that stamped it, as the camera calls it
  std::uint64_t number = 0;  ///< counts the images of a stream; 0: not known
  std::chrono::steady_clock::time_point received = std::chrono::steady_clock::now();  ///< by this computer
  cv::Mat pixels;  ///< CV_8UC3 (BGR) or CV_16UC1 (depth, in units of the camera)
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();  ///< rad/s or m/s^2, in the frame of the inertial unit
};

/// The camera does not answer any more: it was unplugged, or its driver failed. What it was doing can be
/// tried again.
class ROSLAM_EXPORT CameraLost : public InputError {
 public:
  using InputError::InputError;
};

/// A camera with colour and depth images, and perhaps an inertial unit, that is connected to this computer:
/// its driver in a few functions. What all cameras need, such as pairing and reconnection, is above it
/// (LiveSource). For one thread at a time.
class ROSLAM_EXPORT DepthCamera {
 public:
  DepthCamera() = default;
  DepthCamera(const DepthCamera&) = delete;
  DepthCamera& operator=(const DepthCamera&) = delete;
  virtual ~DepthCamera() = default;

  /// What it is, in words: "RealSense".
  virtual std::string kind() const = 0;

  /// Those that are connected now.
  virtual std::vector<DepthCameraDevice> devices() = 0;

  /// Starts the streams of the device with that serial number. Throws CameraLost if it is not there or does
  /// not start, InputError if it does not have the mode.
  virtual void open(const std::string& serial, const DepthCameraMode& mode) = 0;

  /// Of the open device.
  virtual DepthCameraCalibration calibration() const = 0;

  /// Waits for what the streams give, at most that long; nothing if nothing came. Throws CameraLost.
  virtual std::vector<CameraSample> wait(std::chrono::milliseconds at_most) = 0;

  /// Makes the device start anew, as if it had been unplugged; it is back after some seconds. Does nothing if
  /// it is not there. Throws CameraLost.
  virtual void reset(const std::string& serial) = 0;

  /// Stops the streams. Does nothing if it is not open.
  virtual void close() noexcept = 0;
};

}  // namespace roslam
