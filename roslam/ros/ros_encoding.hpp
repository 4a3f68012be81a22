// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/ros/ros_messages.hpp"

namespace roslam {

class RosWriter;

/// A ROS 2 message in CDR.
using RosMessage = std::vector<std::uint8_t>;

/// Each encodes a message of the type in its name, the inverse of those in ros_messages.hpp.
/// pixels: CV_8UC3 (bgr8), CV_8UC1 (mono8), CV_16UC1 (16UC1) or CV_32FC1 (32FC1). Throws InputError for
/// others.
ROSLAM_EXPORT RosMessage encode_image(const RosHeader& header, const cv::Mat& pixels);

/// format: such as jpeg; data: of the file.
ROSLAM_EXPORT RosMessage encode_compressed_image(const RosHeader& header, std::string_view format,
                                                 std::span<const std::uint8_t> data);

/// The calibration of the raw image; P is that of an image without distortion.
ROSLAM_EXPORT RosMessage encode_camera_info(const RosHeader& header, const Camera& camera);

/// Without orientation, whose covariance begins with -1, as ROS marks that.
ROSLAM_EXPORT RosMessage encode_imu(const RosImu& imu);

/// tf2_msgs/TFMessage.
ROSLAM_EXPORT RosMessage encode_transforms(const std::vector<RosTransform>& transforms);

/// geometry_msgs/PoseStamped; the child is not written.
ROSLAM_EXPORT RosMessage encode_pose(const RosTransform& pose);

/// std_msgs/String.
ROSLAM_EXPORT RosMessage encode_text(std::string_view text);

/// Three numbers, as geometry_msgs/Vector3 and Point have them.
ROSLAM_EXPORT void put_vector(RosWriter& writer, const Eigen::Vector3d& vector);

/// A position and a quaternion x y z w, the fields of most messages that hold a pose.
ROSLAM_EXPORT void put_pose(RosWriter& writer, const SE3& pose);

}  // namespace roslam
