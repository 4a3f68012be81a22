// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/recording_contents.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/geometry/camera_import.hpp"
#include "roslam/ros/realsense_topics.hpp"

namespace roslam {

namespace {
constexpr std::size_t kEnoughImages = 30;        // of each topic, to know its rate
constexpr std::size_t kMostBytes = 500U << 20U;  // that are looked at for the beginning

constexpr std::size_t kMostFaults = 100;  // of different kinds

// Rates are not exact: clocks drift, and times are rounded.
double nearly_whole(double value, double tolerance) {
  const double whole = std::round(value);
  return whole > 0.0 && std::abs(value - whole) < tolerance * whole ? whole : value;
}

// The topic of the calibration beside that of the images.
std::string info_topic_of(std::string images) {
  for (const std::string end : {"/compressedDepth", "/compressed"}) {
    if (images.ends_with(end)) images.resize(images.size() - end.size());
  }
  const std::size_t slash = images.rfind('/');
  return (slash == std::string::npos ? std::string() : images.substr(0, slash)) + "/camera_info";
}

// Goes through the messages of a recording and notes what they tell.
class Survey {
 public:
  Survey(Recording& recording, LookAt part) : recording_(recording), part_(part) {
    for (const RecordedTopic& topic : recording.topics()) add(topic);
  }

  RecordingContents take() {
    recording_.select(wanted_);
    std::size_t bytes = 0;
    while (const auto message = recording_.next()) {
      bytes += message->data.size();
      const RecordedTopic& topic = recording_.topics()[static_cast<std::size_t>(message->topic)];
      try {
        note(topic, message->data);
      } catch (const Error& error) {
        if (const auto images = images_.find(topic.id); images != images_.end())
          ++contents_.images[images->second].faults[error.what()];
        else if (contents_.faults.size() < kMostFaults)
          ++contents_.faults[topic.name + ": " + error.what()];
      }
      if (part_ == LookAt::kBeginning && (bytes > kMostBytes || knows_enough())) {
        contents_.is_whole = false;
        break;
      }
    }
    recording_.select({});
    place_realsense();
    attach_infos();
    return std::move(contents_);
  }

 private:
  void add(const RecordedTopic& topic) {
    const std::string type = plain_type(topic.type);
    const bool is_stream = realsense_stream(topic.name).has_value();
    contents_.is_realsense |= is_stream;
    const bool is_image = type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage";
    const bool is_pose = type == "geometry_msgs/PoseStamped" || type == "nav_msgs/Odometry" ||
                         type == "geometry_msgs/TransformStamped" ||
                         type == "geometry_msgs/PoseWithCovarianceStamped";
    if (is_image) {
      images_[topic.id] = contents_.images.size();
      RecordedImages images;
      images.topic = topic;
      images.is_compressed = type == "sensor_msgs/CompressedImage";
      contents_.images.push_back(std::move(images));
    }
    if (type == "sensor_msgs/Imu") contents_.inertial.push_back(topic);
    if (is_pose) contents_.poses.push_back(topic);
    const bool is_tf = type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
    if (is_tf) contents_.transforms.push_back(topic);
    const bool is_camera = topic.name == kCameraTopic && type == "std_msgs/String";
    const bool tells =
        is_image || is_camera || is_tf || type == "sensor_msgs/CameraInfo" || type == "sensor_msgs/Imu" ||
        (topic.name.starts_with("/device_") && topic.name.find("/sensor_") != std::string::npos);
    if (tells) wanted_.insert(topic.id);
    if (type == "sensor_msgs/CameraInfo" || is_tf || is_camera) awaited_.insert(topic.id);
  }

  void note(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
    awaited_.erase(topic.id);
    if (const auto images = images_.find(topic.id); images != images_.end())
      return note_image(contents_.images[images->second], message);
    if (topic.name == kCameraTopic) {
      RosReader reader(message, encoding_of(topic));
      contents_.camera = camera_from_yaml(reader.text(), "its camera file");
      return;
    }
    const std::string type = plain_type(topic.type);
    if (type == "sensor_msgs/Imu") {
      auto& frame = contents_.inertial_frames[topic.id];
      if (frame.empty())
        frame = realsense_stream(topic.name).value_or(decode_imu(message, encoding_of(topic)).header.frame);
      return;
    }
    if (const auto stream = realsense_stream(topic.name)) {
      if (const auto info = realsense_camera_info(topic, message)) infos_.try_emplace(topic.name, *info);
      if (const auto transform = realsense_extrinsics(topic, message))
        extrinsics_.try_emplace(*stream, *transform);
      if (const auto rate = realsense_rate(topic, message)) rates_.try_emplace(*stream, *rate);
      if (const auto clock = realsense_clock(topic, message)) clocks_.try_emplace(*stream, *clock);
    }
    if (topic.name.starts_with("/device_")) {
      if (const auto unit = realsense_depth_unit(topic, message))
        units_.try_emplace(realsense_sensor(topic.name), nearly_whole(1.0 / *unit, 1e-4));
      return;
    }
    if (type == "sensor_msgs/CameraInfo") {
      infos_.try_emplace(topic.name, decode_camera_info(message, encoding_of(topic)));
    } else if (const auto transforms = decode_transforms(type, message, encoding_of(topic))) {
      // Old recordings tell of fixed frames in /tf as well.
      const bool is_static = topic.name.ends_with("tf_static");
      for (const RosTransform& t : *transforms)
        contents_.frames.add(t.header.frame, t.child, t.T_parent_child, is_static);
    }
  }

  void note_image(RecordedImages& images, std::span<const std::uint8_t> message) {
    const RosImage image = decode_image_of(images, message, contents_.is_realsense);
    images.stamps.push_back(image.header.stamp);
    if (images.stamps.size() > 1) return;
    images.encoding = image.encoding;
    images.kind = kind_of(image);
    images.size = {image.width, image.height};
    images.frame = realsense_stream(images.topic.name).value_or(image.header.frame);
  }

  bool knows_enough() const {
    const bool has_images =
        std::all_of(contents_.images.begin(), contents_.images.end(), [](const auto& images) {
          return images.stamps.size() >=
                     std::min(kEnoughImages, images.topic.messages.value_or(kEnoughImages)) ||
                 !images.faults.empty();
        });
    return has_images && awaited_.empty();
  }

  // Streams hang on the reference stream of the device.
  void place_realsense() {
    for (const auto& [stream, T_stream_reference] : extrinsics_)
      contents_.frames.add("realsense reference", stream, T_stream_reference.inverse());
  }

  void attach_infos() {
    for (RecordedImages& images : contents_.images) {
      const auto stream = realsense_stream(images.topic.name);
      const std::vector<std::string> names =
          stream ? std::vector<std::string>{*stream + "/info/camera_info", *stream + "/camera_info"}
                 : std::vector<std::string>{info_topic_of(images.topic.name)};
      for (const std::string& name : names) {
        if (const auto info = infos_.find(name); info != infos_.end()) images.info = info->second;
      }
      if (!stream) continue;
      if (const auto clock = clocks_.find(*stream); clock != clocks_.end()) images.clock = clock->second;
      if (const auto rate = rates_.find(*stream); rate != rates_.end()) images.nominal_rate = rate->second;
      if (const auto unit = units_.find(realsense_sensor(*stream)); unit != units_.end())
        images.units_per_metre = unit->second;
    }
  }

  Recording& recording_;
  LookAt part_;
  RecordingContents contents_;
  std::map<int, std::size_t> images_;  // by topic
  std::set<int> wanted_, awaited_;
  std::map<std::string, RosCameraInfo> infos_;  // by topic
  std::map<std::string, SE3> extrinsics_;       // by stream
  std::map<std::string, std::string> clocks_;   // likewise
  std::map<std::string, double> rates_;         // likewise
  std::map<std::string, double> units_;         // by sensor
};
}  // namespace

double RecordedImages::rate() const {
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) intervals.push_back(stamps[i] - stamps[i - 1]);
  constexpr std::size_t kFew = 5;
  if (intervals.empty() || (intervals.size() < kFew && nominal_rate > 0.0)) return nominal_rate;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  constexpr double kTolerance = 0.02;
  return nearly_whole(1e9 / static_cast<double>(*middle), kTolerance);
}

RecordingContents contents_of(Recording& recording, LookAt part) { return Survey(recording, part).take(); }

RosEncoding encoding_of(const RecordedTopic& topic) {
  if (topic.encoding == "ros1") return RosEncoding::kRos1;
  if (topic.encoding == "cdr") return RosEncoding::kCdr;
  throw InputError(topic.name + ": messages of the encoding '" + topic.encoding +
                   "', which is not supported");
}

RosImage decode_image_of(const RecordedImages& images, std::span<const std::uint8_t> message,
                         bool is_realsense) {
  const RosEncoding encoding = encoding_of(images.topic);
  RosImage image =
      images.is_compressed ? decode_compressed_image(message, encoding) : decode_image(message, encoding);
  // The SDK calls YUYV what ROS calls UYVY.
  if (is_realsense && image.encoding == "yuv422") image.encoding = "yuyv";
  return image;
}

}  // namespace roslam
