// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "roslam/geometry/trajectory.hpp"
#include "roslam/odometry/odometry.hpp"
#include "roslam/ros/ros_encoding.hpp"

namespace roslam::recording {

/// Names of coordinate frames as REP 103 and REP 105 have them. The pose of a frame in its parent is
/// T_map_odom, T_odom_body and Camera::T_body_camera.
inline constexpr const char* kMapFrame = "map";
inline constexpr const char* kOdomFrame = "odom";
inline constexpr const char* kBodyFrame = "base_link";
inline constexpr const char* kCameraFrame = "camera_optical_frame";

/// A time in seconds as ROS stamps it, in nanoseconds. It is rounded to a microsecond, as the times in the
/// files of a run are, so that what belongs to one frame has one stamp. Throws InputError for a time that ROS
/// cannot stamp: below 0 or from 2^31 on.
std::int64_t ros_stamp(double seconds);

/// nav_msgs/Odometry: T_odom_body and its covariance in odom, the velocities and theirs in base_link.
RosMessage encode_odometry(const Odometry& odometry);

/// nav_msgs/Path, each pose with its own time. frame: that the poses are in.
RosMessage encode_path(std::int64_t stamp, std::string_view frame, std::span<const StampedPose> poses);

struct ColouredPoint {
  Eigen::Vector3f position;  ///< metres
  cv::Vec3b colour;          ///< BGR
};

/// sensor_msgs/PointCloud2, a row of points of 16 bytes: x y z (float) and rgb, four bytes 0x00RRGGBB that
/// are declared as a float, as the Point Cloud Library does.
RosMessage encode_points(const RosHeader& header, std::span<const ColouredPoint> points);

}  // namespace roslam::recording
