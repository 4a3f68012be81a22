// SPDX-License-Identifier: BSD-3-Clause
// Messages of ROS 1 and CDR. The first byte chooses the encoding and the type.
#include <array>
#include <cstdint>

#include "fuzz/fuzz.hpp"
#include "roslam/ros/ros_images.hpp"
#include "roslam/ros/ros_messages.hpp"

namespace {
using namespace roslam;

void decode(std::uint8_t choice, std::span<const std::uint8_t> message) {
  constexpr std::array kTransforms{"tf2_msgs/TFMessage", "nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                                   "geometry_msgs/TransformStamped"};
  const RosEncoding encoding = choice % 2 == 0 ? RosEncoding::kRos1 : RosEncoding::kCdr;
  const std::size_t type = choice / 2U % 8U;
  if (type < kTransforms.size()) {
    decode_transforms(kTransforms[type], message, encoding);
  } else if (type == 4) {
    camera_of(decode_camera_info(message, encoding));
  } else if (type == 5) {
    decode_imu(message, encoding);
  } else {
    const RosImage image =
        type == 6 ? decode_image(message, encoding) : decode_compressed_image(message, encoding);
    if (kind_of(image) == PixelKind::kDepth)
      depth_pixels(image, 1000.0);
    else
      colour_pixels(image);
  }
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    if (bytes.empty()) return;
    const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
    decode(begin[0], {begin + 1, bytes.size() - 1});
  });
}
