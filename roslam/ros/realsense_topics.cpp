// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/realsense_topics.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

#include "roslam/ros/recording_contents.hpp"

namespace roslam {

namespace {
using Values = std::map<std::string, std::string, std::less<>>;

bool ends_with_any(std::string_view name, std::initializer_list<std::string_view> ends) {
  return std::any_of(ends.begin(), ends.end(), [&](std::string_view end) { return name.ends_with(end); });
}

// The text of a std_msgs/String, "key=value;key=value".
Values values_of(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
  RosReader reader(message, encoding_of(topic));
  const std::string text = reader.text();
  Values values;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(';', at), text.size());
    const std::string entry = text.substr(at, end - at);
    const std::size_t equals = entry.find('=');
    if (equals != std::string::npos) values[entry.substr(0, equals)] = entry.substr(equals + 1);
    at = end + 1;
  }
  return values;
}

std::vector<double> numbers_of(const Values& values, std::string_view key) {
  const auto found = values.find(key);
  if (found == values.end()) throw InputError("RealSense message without " + std::string(key));
  const std::string& text = found->second;
  std::vector<double> numbers;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    double value = 0.0;
    const char* first = text.data() + at;
    while (first < text.data() + end && *first == ' ') ++first;
    const auto [last, error] = std::from_chars(first, text.data() + end, value);
    if (error != std::errc() || last == first || !std::isfinite(value))
      throw InputError("RealSense message whose " + std::string(key) + " is no number: " + text);
    numbers.push_back(value);
    at = end + 1;
  }
  return numbers;
}

double number_of(const Values& values, std::string_view key) {
  const auto numbers = numbers_of(values, key);
  if (numbers.size() != 1) throw InputError("RealSense message whose " + std::string(key) + " is no number");
  return numbers.front();
}

int pixels_of(const Values& values, std::string_view key) {
  const double value = number_of(values, key);
  if (!(value >= 0.0 && value < 1e5))
    throw InputError("RealSense message of an impossible " + std::string(key));
  return static_cast<int>(value);
}

bool is_text(const RecordedTopic& topic) { return plain_type(topic.type) == "std_msgs/String"; }
}  // namespace

std::optional<std::string> realsense_stream(const std::string& topic) {
  if (!topic.starts_with("/device_")) return std::nullopt;
  const std::size_t sensor = topic.find("/sensor_");
  if (sensor == std::string::npos) return std::nullopt;
  const std::size_t stream = topic.find('/', sensor + 1);
  if (stream == std::string::npos) return std::nullopt;
  const std::size_t end = topic.find('/', stream + 1);
  if (end == std::string::npos) return std::nullopt;
  const std::string name = topic.substr(stream + 1, end - stream - 1);
  // Other topics of a sensor: info and option.
  return name.find('_') == std::string::npos ? std::nullopt : std::optional(topic.substr(0, end));
}

std::string realsense_sensor(const std::string& topic) {
  const std::size_t sensor = topic.find("/sensor_");
  if (sensor == std::string::npos) return topic;
  return topic.substr(0, topic.find('/', sensor + 1));
}

std::optional<RosCameraInfo> realsense_camera_info(const RecordedTopic& topic,
                                                   std::span<const std::uint8_t> message) {
  if (!topic.name.ends_with("/camera_info")) return std::nullopt;
  if (!is_text(topic)) return decode_camera_info(message, encoding_of(topic));
  const Values values = values_of(topic, message);
  RosCameraInfo info;
  info.width = pixels_of(values, "width");
  info.height = pixels_of(values, "height");
  info.K = {number_of(values, "fx"),
            0.0,
            number_of(values, "ppx"),
            0.0,
            number_of(values, "fy"),
            number_of(values, "ppy"),
            0.0,
            0.0,
            1.0};
  if (const auto model = values.find("model"); model != values.end()) info.model = model->second;
  std::replace(info.model.begin(), info.model.end(), '_', ' ');
  info.distortion = numbers_of(values, "coeffs");
  return info;
}

std::optional<SE3> realsense_extrinsics(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
  if (!ends_with_any(topic.name, {"/tf/0", "/tf/ref_0"})) return std::nullopt;
  constexpr double kRounding = 1e-2;
  if (!is_text(topic)) {
    RosReader reader(message, encoding_of(topic));
    std::array<double, 7> v{};  // geometry_msgs/Transform
    reader.get(v);
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (!(std::abs(rotation.norm() - 1.0) < kRounding))
      throw InputError("extrinsics without a unit quaternion");
    return SE3(rotation.normalized(), {v[0], v[1], v[2]});
  }
  const Values values = values_of(topic, message);
  const auto rotation = numbers_of(values, "rotation"), translation = numbers_of(values, "translation");
  if (rotation.size() != 9 || translation.size() != 3) throw InputError("extrinsics that are no transform");
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix3d>(rotation.data());  // by columns
  if (!(R * R.transpose()).isIdentity(kRounding) || R.determinant() < 0.0)
    throw InputError("extrinsics whose rotation is none");
  return SE3(Eigen::Quaterniond(R).normalized(), {translation[0], translation[1], translation[2]});
}

std::optional<std::string> realsense_clock(const RecordedTopic& topic,
                                           std::span<const std::uint8_t> message) {
  if (!topic.name.ends_with("/image/metadata")) return std::nullopt;
  std::string clock;
  if (is_text(topic)) {
    const Values values = values_of(topic, message);
    const auto found = values.find("timestamp_domain");
    if (found == values.end()) return std::nullopt;
    clock = found->second;
  } else {
    RosReader reader(message, encoding_of(topic));  // diagnostic_msgs/KeyValue
    if (reader.text() != "timestamp_domain") return std::nullopt;
    clock = reader.text();
  }
  std::replace(clock.begin(), clock.end(), '_', ' ');
  return clock;
}

std::optional<double> realsense_rate(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
  const auto stream = realsense_stream(topic.name + "/");
  if (!stream || topic.name != *stream + "/info") return std::nullopt;
  double rate = 0.0;
  if (is_text(topic)) {
    const Values values = values_of(topic, message);
    if (values.contains("fps")) rate = number_of(values, "fps");
  } else {
    rate = RosReader(message, encoding_of(topic)).get<std::uint32_t>();  // realsense_msgs/StreamInfo
  }
  return rate > 0.0 ? std::optional(rate) : std::nullopt;
}

std::optional<double> realsense_depth_unit(const RecordedTopic& topic,
                                           std::span<const std::uint8_t> message) {
  double unit = 0.0;
  if (ends_with_any(topic.name, {"/option/Depth Units/value", "/option/Depth_Units/value"})) {
    if (is_text(topic)) {
      const Values values = values_of(topic, message);
      if (!values.contains("value")) return std::nullopt;
      unit = number_of(values, "value");
    } else {
      unit = static_cast<double>(RosReader(message, encoding_of(topic)).get<float>());
    }
  } else if (topic.name.ends_with("/image/metadata") && is_text(topic)) {
    const Values values = values_of(topic, message);
    if (!values.contains("depth_units")) return std::nullopt;
    unit = number_of(values, "depth_units");
  }
  return unit > 0.0 ? std::optional(unit) : std::nullopt;
}

}  // namespace roslam
