// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "roslam/recordings/recording.hpp"
#include "roslam/ros/ros_messages.hpp"

namespace roslam {

/// Topics as the RealSense SDK records them, in a ROS 1 bag (to version 2.57) or in a rosbag2 SQLite file,
/// where all but images and inertial samples are texts of key=value;... (from 2.58). A stream, such as
/// /device_0/sensor_1/Color_0, has topics below its name.

/// The stream of a topic, or nothing if it is not of a stream of the SDK.
std::optional<std::string> realsense_stream(const std::string& topic);

/// Each decodes a message of one kind of topic; nothing if the topic is of another.
/// Calibration of a stream:
std::optional<RosCameraInfo> realsense_camera_info(const RecordedTopic& topic,
                                                   std::span<const std::uint8_t> message);
/// T_stream_reference: from the frame of the reference stream to that of this one.
std::optional<SE3> realsense_extrinsics(const RecordedTopic& topic, std::span<const std::uint8_t> message);
/// The clock in the metadata of an image:
std::optional<std::string> realsense_clock(const RecordedTopic& topic, std::span<const std::uint8_t> message);
/// Metres of a unit of depth; of the sensor that the topic belongs to.
std::optional<double> realsense_depth_unit(const RecordedTopic& topic, std::span<const std::uint8_t> message);

/// Images a second, as they were asked for:
std::optional<double> realsense_rate(const RecordedTopic& topic, std::span<const std::uint8_t> message);

/// The sensor of a topic or stream: /device_0/sensor_0.
std::string realsense_sensor(const std::string& topic);

}  // namespace roslam
