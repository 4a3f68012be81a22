// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/ros_encoding.hpp"

#include <array>

#include "roslam/common/error.hpp"
#include "roslam/ros/ros_writer.hpp"

namespace roslam {

namespace {
std::string_view encoding_of(const cv::Mat& pixels) {
  switch (pixels.type()) {
    case CV_8UC3:
      return "bgr8";
    case CV_8UC1:
      return "mono8";
    case CV_16UC1:
      return "16UC1";
    case CV_32FC1:
      return "32FC1";
    default:
      throw InputError("image of a type that cannot be recorded: " + std::to_string(pixels.type()));
  }
}

std::string_view model_of(const Camera& camera) {
  if (camera.model == LensModel::kFisheye) return "equidistant";
  constexpr std::size_t kPlumbBob = 5;
  return camera.coefficients().size() > kPlumbBob ? "rational_polynomial" : "plumb_bob";
}
}  // namespace

void put_vector(RosWriter& writer, const Eigen::Vector3d& vector) {
  for (int k = 0; k < 3; ++k) writer.put(vector(k));
}

void put_pose(RosWriter& writer, const SE3& pose) {
  put_vector(writer, pose.translation());
  const Eigen::Quaterniond& rotation = pose.rotation();
  for (const double value : {rotation.x(), rotation.y(), rotation.z(), rotation.w()}) writer.put(value);
}

RosMessage encode_image(const RosHeader& header, const cv::Mat& pixels) {
  const std::string_view encoding = encoding_of(pixels);
  RosWriter writer;
  writer.header(header.stamp, header.frame);
  writer.put(static_cast<std::uint32_t>(pixels.rows));
  writer.put(static_cast<std::uint32_t>(pixels.cols));
  writer.text(encoding);
  writer.put(std::uint8_t{0});  // little-endian
  const std::size_t step = static_cast<std::size_t>(pixels.cols) * pixels.elemSize();
  writer.reserve(step * static_cast<std::size_t>(pixels.rows));
  writer.put(static_cast<std::uint32_t>(step));
  writer.count(step * static_cast<std::size_t>(pixels.rows));
  for (int y = 0; y < pixels.rows; ++y) writer.raw({pixels.ptr(y), step});
  return writer.take();
}

RosMessage encode_compressed_image(const RosHeader& header, std::string_view format,
                                   std::span<const std::uint8_t> data) {
  RosWriter writer;
  writer.header(header.stamp, header.frame);
  writer.text(format);
  writer.bytes(data);
  return writer.take();
}

RosMessage encode_camera_info(const RosHeader& header, const Camera& camera) {
  RosWriter writer;
  writer.header(header.stamp, header.frame);
  writer.put(static_cast<std::uint32_t>(camera.height));
  writer.put(static_cast<std::uint32_t>(camera.width));
  writer.text(model_of(camera));
  const auto coefficients = camera.coefficients();
  writer.count(coefficients.size());
  writer.numbers(coefficients);
  writer.numbers(std::array{camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0});
  writer.numbers(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  writer.numbers(
      std::array{camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  constexpr int kBinningAndRegion = 6;
  for (int i = 0; i < kBinningAndRegion; ++i) writer.put(std::uint32_t{0});
  writer.put(std::uint8_t{0});
  return writer.take();
}

RosMessage encode_imu(const RosImu& imu) {
  RosWriter writer;
  writer.header(imu.header.stamp, imu.header.frame);
  writer.numbers(std::array{0.0, 0.0, 0.0, 1.0});
  std::array<double, 9> unknown{};
  writer.numbers(std::array{-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  put_vector(writer, imu.turn_rate);
  writer.numbers(unknown);
  put_vector(writer, imu.acceleration);
  writer.numbers(unknown);
  return writer.take();
}

RosMessage encode_transforms(const std::vector<RosTransform>& transforms) {
  RosWriter writer;
  writer.count(transforms.size());
  for (const RosTransform& transform : transforms) {
    writer.header(transform.header.stamp, transform.header.frame);
    writer.text(transform.child);
    put_pose(writer, transform.T_parent_child);
  }
  return writer.take();
}

RosMessage encode_pose(const RosTransform& pose) {
  RosWriter writer;
  writer.header(pose.header.stamp, pose.header.frame);
  put_pose(writer, pose.T_parent_child);
  return writer.take();
}

RosMessage encode_text(std::string_view text) {
  RosWriter writer;
  writer.text(text);
  return writer.take();
}

}  // namespace roslam
