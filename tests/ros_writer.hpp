// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

/// Messages of ROS 1 and ROS 2 for tests.
namespace roslam::ros {

using Bytes = std::vector<std::uint8_t>;

enum class Version { kRos1, kRos2 };

/// Writes the fields of a message in their order.
class Writer {
 public:
  explicit Writer(Version version) : version_(version) {
    if (version == Version::kRos2) bytes_ = {0, 1, 0, 0};
  }

  template <typename T>
  void put(T value) {
    if (version_ == Version::kRos2)
      while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(0xcd);  // padding has no meaning
    const auto at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }

  void put_text(std::string_view text) {
    const bool has_end = version_ == Version::kRos2;
    put(static_cast<std::uint32_t>(text.size() + (has_end ? 1 : 0)));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    if (has_end) bytes_.push_back(0);
  }

  void put_bytes(const Bytes& bytes) {
    put(static_cast<std::uint32_t>(bytes.size()));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }

  void put_header(std::int64_t stamp, std::string_view frame) {
    if (version_ == Version::kRos1) put(std::uint32_t{7});
    put(static_cast<std::int32_t>(stamp / 1000000000));
    put(static_cast<std::uint32_t>(stamp % 1000000000));
    put_text(frame);
  }

  void put_pose(const SE3& pose) {
    for (int k = 0; k < 3; ++k) put(pose.translation()(k));
    const auto& q = pose.rotation();
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) put(value);
  }

  Bytes take() { return std::move(bytes_); }

 private:
  Version version_;
  Bytes bytes_;
};

inline Bytes image(Version version, std::int64_t stamp, std::string_view frame, std::string_view encoding,
                   const cv::Mat& pixels) {
  Writer writer(version);
  writer.put_header(stamp, frame);
  writer.put(static_cast<std::uint32_t>(pixels.rows));
  writer.put(static_cast<std::uint32_t>(pixels.cols));
  writer.put_text(encoding);
  writer.put(std::uint8_t{0});
  const std::size_t step = static_cast<std::size_t>(pixels.cols) * pixels.elemSize();
  writer.put(static_cast<std::uint32_t>(step));
  Bytes data;
  for (int y = 0; y < pixels.rows; ++y) data.insert(data.end(), pixels.ptr(y), pixels.ptr(y) + step);
  writer.put_bytes(data);
  return writer.take();
}

inline Bytes compressed_image(Version version, std::int64_t stamp, std::string_view frame,
                              std::string_view format, const Bytes& data) {
  Writer writer(version);
  writer.put_header(stamp, frame);
  writer.put_text(format);
  writer.put_bytes(data);
  return writer.take();
}

inline Bytes camera_info(Version version, std::int64_t stamp, std::string_view frame, const Camera& camera,
                         std::string_view model = "plumb_bob") {
  Writer writer(version);
  writer.put_header(stamp, frame);
  writer.put(static_cast<std::uint32_t>(camera.height));
  writer.put(static_cast<std::uint32_t>(camera.width));
  writer.put_text(model);
  writer.put(std::uint32_t{5});
  for (std::size_t i = 0; i < 5; ++i) writer.put(camera.distortion[i]);
  for (const double value : {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0})
    writer.put(value);
  for (const double value : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) writer.put(value);
  for (const double value :
       {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0})
    writer.put(value);
  for (int i = 0; i < 6; ++i) writer.put(std::uint32_t{0});  // binning, region of interest
  writer.put(std::uint8_t{0});
  return writer.take();
}

inline Bytes imu(Version version, std::int64_t stamp, std::string_view frame,
                 const Eigen::Vector3d& turn_rate, const Eigen::Vector3d& acceleration) {
  Writer writer(version);
  writer.put_header(stamp, frame);
  for (const double value : {0.0, 0.0, 0.0, 1.0}) writer.put(value);
  for (int i = 0; i < 9; ++i) writer.put(0.01 * i);
  for (int k = 0; k < 3; ++k) writer.put(turn_rate(k));
  for (int i = 0; i < 9; ++i) writer.put(0.02 * i);
  for (int k = 0; k < 3; ++k) writer.put(acceleration(k));
  for (int i = 0; i < 9; ++i) writer.put(0.03 * i);
  return writer.take();
}

inline Bytes pose_stamped(Version version, std::int64_t stamp, std::string_view frame, const SE3& pose) {
  Writer writer(version);
  writer.put_header(stamp, frame);
  writer.put_pose(pose);
  return writer.take();
}

inline Bytes odometry(Version version, std::int64_t stamp, std::string_view frame, std::string_view child,
                      const SE3& pose) {
  Writer writer(version);
  writer.put_header(stamp, frame);
  writer.put_text(child);
  writer.put_pose(pose);
  for (int i = 0; i < 36 + 6 + 36; ++i) writer.put(0.5);
  return writer.take();
}

struct Transform {
  std::string parent, child;
  SE3 T_parent_child;
};

inline Bytes tf(Version version, std::int64_t stamp, const std::vector<Transform>& transforms) {
  Writer writer(version);
  writer.put(static_cast<std::uint32_t>(transforms.size()));
  for (const Transform& transform : transforms) {
    writer.put_header(stamp, transform.parent);
    writer.put_text(transform.child);
    writer.put_pose(transform.T_parent_child);
  }
  return writer.take();
}

}  // namespace roslam::ros
