// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/timestamp.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/ros/ros_reader.hpp"

namespace roslam {

/// Of most messages.
struct RosHeader {
  std::int64_t stamp = 0;  ///< nanoseconds
  std::string frame;       ///< name of the coordinate frame
};

/// sensor_msgs/Image and sensor_msgs/CompressedImage; data is of the message.
struct RosImage {
  RosHeader header;
  int width = 0, height = 0;  ///< pixels; 0 of a compressed image
  std::string encoding;       ///< such as rgb8 or 16UC1; of a compressed image its format
  bool is_compressed = false;
  std::size_t step = 0;  ///< bytes of a row
  std::span<const std::uint8_t> data;
};

/// sensor_msgs/CameraInfo.
struct RosCameraInfo {
  RosHeader header;
  int width = 0, height = 0;
  std::string model;               ///< of the distortion: plumb_bob, rational_polynomial, equidistant, ...
  std::vector<double> distortion;  ///< D
  std::array<double, 9> K{};
  std::array<double, 12> P{};  ///< of rectified images; zeros if not known
};

/// sensor_msgs/Imu.
struct RosImu {
  RosHeader header;
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();     ///< rad/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s^2
};

/// A pose of a frame in another: geometry_msgs/PoseStamped, TransformStamped, nav_msgs/Odometry, or one of a
/// tf2_msgs/TFMessage.
struct RosTransform {
  RosHeader header;   ///< frame: the parent
  std::string child;  ///< empty if the message does not name it
  SE3 T_parent_child;
};

/// A message type without the folder "msg" of ROS 2: sensor_msgs/Image.
std::string plain_type(std::string_view type);

/// Each decodes a message of the type in its name. All throw InputError, without the name of the file, if the
/// message is truncated or holds what cannot be.
RosImage decode_image(std::span<const std::uint8_t> message, RosEncoding encoding);
RosImage decode_compressed_image(std::span<const std::uint8_t> message, RosEncoding encoding);
RosCameraInfo decode_camera_info(std::span<const std::uint8_t> message, RosEncoding encoding);
RosImu decode_imu(std::span<const std::uint8_t> message, RosEncoding encoding);

/// type: a plain type of those that RosTransform lists; nothing for others.
std::optional<std::vector<RosTransform>> decode_transforms(std::string_view type,
                                                           std::span<const std::uint8_t> message,
                                                           RosEncoding encoding);

/// The calibration in a camera_info message, of the raw image or of the rectified one. Throws
/// CalibrationError, without the name of the file, for a model of distortion that is not known, and if the
/// calibration is not valid, such as all zeros.
Camera camera_of(const RosCameraInfo& info, bool is_rectified = false);

}  // namespace roslam
