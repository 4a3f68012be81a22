// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/ros_messages.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr std::uint32_t kLargestSide = 16384;  // pixels

RosHeader header_of(RosReader& reader) {
  if (reader.encoding() == RosEncoding::kRos1) reader.get<std::uint32_t>();  // sequence number
  RosHeader header;
  header.stamp = reader.time();
  header.frame = reader.text();
  return header;
}

int side_of(std::uint32_t pixels) {
  if (pixels > kLargestSide)
    throw InputError("image of " + std::to_string(pixels) + " pixels a side is too large");
  return static_cast<int>(pixels);
}

Eigen::Vector3d vector_of(RosReader& reader) {
  const auto x = reader.get<double>(), y = reader.get<double>(), z = reader.get<double>();
  return {x, y, z};
}

// Translation, then the quaternion x y z w; nothing if it is no pose.
std::optional<SE3> pose_of(RosReader& reader) {
  const Eigen::Vector3d translation = vector_of(reader);
  const Eigen::Vector3d imaginary = vector_of(reader);
  const Eigen::Quaterniond rotation(reader.get<double>(), imaginary.x(), imaginary.y(), imaginary.z());
  constexpr double kRounding = 1e-2;
  if (!translation.allFinite() || !(std::abs(rotation.norm() - 1.0) < kRounding)) return std::nullopt;
  return SE3(rotation.normalized(), translation);
}

// Models as ROS and the RealSense SDK name them. The SDK's own projection applies the inverse of Brown's
// model forward, and realsense-ros publishes it as plumb_bob as well.
void set_lens(const RosCameraInfo& info, Camera& camera) {
  const std::string& model = info.model;
  const bool is_pinhole =
      model == "plumb_bob" || model == "rational_polynomial" || model.ends_with("Brown Conrady");
  const bool is_fisheye = model == "equidistant" || model == "fisheye" || model == "Kannala Brandt4";
  if (!is_pinhole && !is_fisheye)
    throw CalibrationError("camera_info has a lens of the model '" + model + "', which is not supported");
  std::vector<double> coefficients = info.distortion;
  constexpr std::size_t kOfFisheye = 4;
  if (is_fisheye && coefficients.size() > kOfFisheye) coefficients.resize(kOfFisheye);  // padded by zeros
  try {
    camera.set_lens(is_fisheye ? "fisheye" : "pinhole", coefficients);
  } catch (const InputError& error) {
    throw CalibrationError(std::string("camera_info: ") + error.what());
  }
}
}  // namespace

std::string plain_type(std::string_view type) {
  const std::size_t folder = type.find("/msg/");
  if (folder == std::string_view::npos) return std::string(type);
  return std::string(type.substr(0, folder)) + std::string(type.substr(folder + 4));
}

RosImage decode_image(std::span<const std::uint8_t> message, RosEncoding encoding) {
  RosReader reader(message, encoding);
  RosImage image;
  image.header = header_of(reader);
  image.height = side_of(reader.get<std::uint32_t>());
  image.width = side_of(reader.get<std::uint32_t>());
  image.encoding = reader.text();
  if (reader.get<std::uint8_t>() != 0 && image.encoding.find("16") != std::string::npos)
    throw InputError("image of big-endian pixels");
  image.step = reader.get<std::uint32_t>();
  image.data = reader.bytes();
  if (image.width == 0 || image.height == 0) throw InputError("image without pixels");
  if (image.step * static_cast<std::size_t>(image.height) > image.data.size())
    throw InputError("image is truncated");
  return image;
}

RosImage decode_compressed_image(std::span<const std::uint8_t> message, RosEncoding encoding) {
  RosReader reader(message, encoding);
  RosImage image;
  image.is_compressed = true;
  image.header = header_of(reader);
  image.encoding = reader.text();
  image.data = reader.bytes();
  if (image.data.empty()) throw InputError("image is empty");
  return image;
}

RosCameraInfo decode_camera_info(std::span<const std::uint8_t> message, RosEncoding encoding) {
  RosReader reader(message, encoding);
  RosCameraInfo info;
  info.header = header_of(reader);
  info.height = side_of(reader.get<std::uint32_t>());
  info.width = side_of(reader.get<std::uint32_t>());
  info.model = reader.text();
  info.distortion = reader.numbers();
  reader.get(info.K);
  std::array<double, 9> R{};
  reader.get(R);
  reader.get(info.P);
  return info;
}

RosImu decode_imu(std::span<const std::uint8_t> message, RosEncoding encoding) {
  RosReader reader(message, encoding);
  std::array<double, 9> covariance{};
  RosImu imu;
  imu.header = header_of(reader);
  for (int i = 0; i < 4; ++i) reader.get<double>();  // orientation
  reader.get(covariance);
  imu.turn_rate = vector_of(reader);
  reader.get(covariance);
  imu.acceleration = vector_of(reader);
  return imu;
}

std::optional<std::vector<RosTransform>> decode_transforms(std::string_view type,
                                                           std::span<const std::uint8_t> message,
                                                           RosEncoding encoding) {
  const bool is_tf = type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
  const bool is_transform = type == "geometry_msgs/TransformStamped";
  const bool is_odometry = type == "nav_msgs/Odometry";
  const bool is_pose =
      type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped";
  if (!is_tf && !is_transform && !is_odometry && !is_pose) return std::nullopt;
  RosReader reader(message, encoding);
  constexpr std::size_t kLeast = 56;  // bytes of a pose
  const std::size_t count = is_tf ? reader.count(kLeast) : 1;
  std::vector<RosTransform> result;
  for (std::size_t i = 0; i < count; ++i) {
    RosTransform transform;
    transform.header = header_of(reader);
    if (!is_pose) transform.child = reader.text();
    const auto pose = pose_of(reader);
    if (!pose && is_tf) continue;  // of many, such as of a node that has not begun yet
    if (!pose) throw InputError("pose that is not finite or has no unit quaternion");
    transform.T_parent_child = *pose;
    result.push_back(std::move(transform));
  }
  return result;
}

Camera camera_of(const RosCameraInfo& info, bool is_rectified) {
  Camera camera;
  camera.width = info.width;
  camera.height = info.height;
  camera.fx = info.K[0];
  camera.fy = info.K[4];
  camera.cx = info.K[2];
  camera.cy = info.K[5];
  if (is_rectified) {
    camera.fx = info.P[0];
    camera.fy = info.P[5];
    camera.cx = info.P[2];
    camera.cy = info.P[6];
    camera.validate();
    return camera;
  }
  const bool is_undistorted =
      std::all_of(info.distortion.begin(), info.distortion.end(), [](double value) { return value == 0.0; });
  if (!is_undistorted) set_lens(info, camera);
  camera.validate();
  return camera;
}

}  // namespace roslam
