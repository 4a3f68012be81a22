// SPDX-License-Identifier: BSD-3-Clause
#include "recording/display_messages.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/ros/ros_writer.hpp"

namespace roslam::recording {

namespace {
// Row by row, over (x, y, z, rotation x, y, z) as ROS has it too.
void put_covariance(RosWriter& writer, const Matrix6d& covariance) {
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) writer.put(covariance(row, column));
}

constexpr std::size_t kPointBytes = 16;
constexpr std::uint8_t kFloat32 = 7;  // of sensor_msgs/PointField

void put_fields(RosWriter& writer) {
  constexpr std::array<std::string_view, 4> kNames{"x", "y", "z", "rgb"};
  writer.count(kNames.size());
  std::uint32_t offset = 0;
  for (const std::string_view name : kNames) {
    writer.text(name);
    writer.put(offset);
    writer.put(kFloat32);
    writer.put(std::uint32_t{1});
    offset += sizeof(float);
  }
}

std::array<std::uint8_t, kPointBytes> bytes_of(const ColouredPoint& point) {
  std::array<std::uint8_t, kPointBytes> bytes{};
  std::memcpy(bytes.data(), point.position.data(), 3 * sizeof(float));
  for (std::size_t k = 0; k < 3; ++k) bytes[3 * sizeof(float) + k] = point.colour[static_cast<int>(k)];
  return bytes;
}
}  // namespace

std::int64_t ros_stamp(double seconds) {
  constexpr double kEnd = 2147483648.0;  // builtin_interfaces/Time has 32 bits for the seconds
  if (!(seconds >= 0.0 && seconds < kEnd))
    throw InputError("a time that ROS cannot stamp: " + std::to_string(seconds) +
                     " s; it has to be from 0 to 2147483648");
  constexpr std::int64_t kMicrosecond = 1000;  // ns
  return (nanoseconds_of(seconds) + kMicrosecond / 2) / kMicrosecond * kMicrosecond;
}

RosMessage encode_odometry(const Odometry& odometry) {
  RosWriter writer;
  writer.header(ros_stamp(odometry.timestamp), kOdomFrame);
  writer.text(kBodyFrame);
  put_pose(writer, odometry.T_odom_body);
  put_covariance(writer, odometry.covariance);
  put_vector(writer, odometry.linear_velocity);
  put_vector(writer, odometry.angular_velocity);
  put_covariance(writer, odometry.velocity_covariance);
  return writer.take();
}

RosMessage encode_path(std::int64_t stamp, std::string_view frame, std::span<const StampedPose> poses) {
  RosWriter writer;
  writer.header(stamp, frame);
  writer.count(poses.size());
  for (const StampedPose& pose : poses) {
    writer.header(ros_stamp(pose.timestamp), frame);
    put_pose(writer, pose.T_world_camera);
  }
  return writer.take();
}

RosMessage encode_points(const RosHeader& header, std::span<const ColouredPoint> points) {
  RosWriter writer;
  writer.header(header.stamp, header.frame);
  writer.put(std::uint32_t{1});  // a row: the points have no order
  writer.put(static_cast<std::uint32_t>(points.size()));
  put_fields(writer);
  writer.put(std::uint8_t{0});  // little-endian
  writer.put(static_cast<std::uint32_t>(kPointBytes));
  writer.put(static_cast<std::uint32_t>(kPointBytes * points.size()));
  writer.reserve(kPointBytes * points.size());
  writer.count(kPointBytes * points.size());
  for (const ColouredPoint& point : points) writer.raw(bytes_of(point));
  writer.put(std::uint8_t{1});  // every point is valid
  return writer.take();
}

}  // namespace roslam::recording
