// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/camera_recorder.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "roslam/recordings/mcap_writer.hpp"
#include "roslam/ros/recording_contents.hpp"
#include "roslam/ros/ros_definitions.hpp"
#include "roslam/ros/ros_encoding.hpp"

namespace roslam {

enum class CameraRecorder::Topic {
  kCamera,
  kPlaces,
  kColour,
  kColourInfo,
  kDepth,
  kDepthInfo,
  kRegisteredDepth,
  kRegisteredDepthInfo,
  kAccelerometer,
  kGyroscope,
  kInertial,
  kTruth
};

namespace {
constexpr const char* kColourFrame = "camera_color_optical_frame";
constexpr const char* kDepthFrame = "camera_depth_optical_frame";
constexpr const char* kInertialFrame = "camera_imu_optical_frame";
constexpr const char* kWorldFrame = "world";

struct TopicName {
  const char* name;
  const char* type;
};

// By CameraRecorder::Topic.
constexpr std::array<TopicName, 12> kTopics{{
    {kCameraTopic, "std_msgs/msg/String"},
    {"/tf_static", "tf2_msgs/msg/TFMessage"},
    {"/camera/color/image_raw", "sensor_msgs/msg/Image"},
    {"/camera/color/camera_info", "sensor_msgs/msg/CameraInfo"},
    {"/camera/depth/image_rect_raw", "sensor_msgs/msg/Image"},
    {"/camera/depth/camera_info", "sensor_msgs/msg/CameraInfo"},
    {"/camera/aligned_depth_to_color/image_raw", "sensor_msgs/msg/Image"},
    {"/camera/aligned_depth_to_color/camera_info", "sensor_msgs/msg/CameraInfo"},
    {"/camera/accel/sample", "sensor_msgs/msg/Imu"},
    {"/camera/gyro/sample", "sensor_msgs/msg/Imu"},
    {"/camera/imu", "sensor_msgs/msg/Imu"},
    {"/ground_truth/pose", "geometry_msgs/msg/PoseStamped"},
}};

constexpr std::chrono::seconds kFlush{1};  // what is written is brought to the disk as often

McapWriterOptions writer_options(const CameraRecorderOptions& options) {
  McapWriterOptions writing;
  writing.chunk_bytes = options.chunk_bytes;
  if (!options.compresses) writing.compression = Compression::kNone;
  return writing;
}

RosImu imu_of(const CameraSample& sample) {
  RosImu imu;
  imu.header = {sample.stamp, kInertialFrame};
  (sample.stream == CameraStream::kGyroscope ? imu.turn_rate : imu.acceleration) = sample.vector;
  return imu;
}
}  // namespace

CameraRecorder::CameraRecorder(const std::filesystem::path& file, const DepthCameraCalibration& calibration,
                               const CameraRecorderOptions& options)
    : options_(options),
      calibration_(calibration),
      wall_start_(std::chrono::duration_cast<std::chrono::nanoseconds>(
                      std::chrono::system_clock::now().time_since_epoch())
                      .count()),
      steady_start_(std::chrono::steady_clock::now()),
      writer_(std::make_unique<McapWriter>(file, writer_options(options))),
      bytes_(writer_->bytes()),
      thread_([this](const std::stop_token& stop) { write_waiting(stop); }) {}

CameraRecorder::~CameraRecorder() {
  try {
    close();
  } catch (const std::exception&) {  // the caller did not ask
  }
}

// What is told once, at the beginning.
std::vector<CameraRecorder::Message> CameraRecorder::described(std::int64_t time) {
  std::vector<RosTransform> places{{{time, kColourFrame}, kDepthFrame, calibration_.T_colour_depth}};
  if (const auto& imu = calibration_.colour.imu)
    places.push_back({{time, kColourFrame}, kInertialFrame, imu->T_camera_imu});
  std::vector<Message> messages;
  messages.push_back({Topic::kCamera, time, encode_text(camera_to_yaml(calibration_.colour))});
  messages.push_back({Topic::kPlaces, time, encode_transforms(places)});
  return messages;
}

std::vector<CameraRecorder::Message> CameraRecorder::messages_of(const CameraSample& sample) const {
  const auto since_start =
      std::chrono::duration_cast<std::chrono::nanoseconds>(sample.received - steady_start_);
  const std::int64_t time = wall_start_ + since_start.count();
  std::vector<Message> messages;
  switch (sample.stream) {
    case CameraStream::kColour: {
      const RosHeader header{sample.stamp, kColourFrame};
      messages.push_back({Topic::kColour, time, encode_image(header, sample.pixels)});
      messages.push_back({Topic::kColourInfo, time, encode_camera_info(header, calibration_.colour)});
      break;
    }
    case CameraStream::kDepth: {
      const RosHeader header{sample.stamp, kDepthFrame};
      messages.push_back({Topic::kDepth, time, encode_image(header, sample.pixels)});
      messages.push_back({Topic::kDepthInfo, time, encode_camera_info(header, calibration_.depth)});
      break;
    }
    case CameraStream::kAccelerometer:
      messages.push_back({Topic::kAccelerometer, time, encode_imu(imu_of(sample))});
      break;
    case CameraStream::kGyroscope:
      messages.push_back({Topic::kGyroscope, time, encode_imu(imu_of(sample))});
      break;
  }
  return messages;
}

void CameraRecorder::add(const CameraSample& sample) {
  try {
    put(messages_of(sample));
  } catch (const InputError&) {  // pixels of a type that has no name
    const std::scoped_lock lock(mutex_);
    ++lost_;
  }
}

void CameraRecorder::add(const Frame& frame, const std::stop_token& stop) {
  std::vector<Message> messages;
  for (const InertialSample& sample : frame.inertial) {
    const std::int64_t stamp = nanoseconds_of(sample.timestamp);
    messages.push_back({Topic::kInertial, stamp,
                        encode_imu({{stamp, kInertialFrame}, sample.turn_rate, sample.acceleration})});
  }
  const RosHeader header{nanoseconds_of(frame.timestamp), kColourFrame};
  const std::int64_t time = header.stamp;
  if (frame.T_world_camera)
    messages.push_back(
        {Topic::kTruth, time, encode_pose({{time, kWorldFrame}, kColourFrame, *frame.T_world_camera})});
  const RosMessage info = encode_camera_info(header, calibration_.colour);
  messages.push_back({Topic::kColour, time, encode_image(header, frame.colour)});
  messages.push_back({Topic::kColourInfo, time, info});
  if (!frame.depth.empty()) {
    messages.push_back({Topic::kRegisteredDepth, time, encode_image(header, frame.depth)});
    messages.push_back({Topic::kRegisteredDepthInfo, time, info});
  }
  put(std::move(messages), stop);
}

// Readers go by the time of the recording: it must not go back where the clock of a source does.
std::int64_t CameraRecorder::next_time(std::int64_t time) {
  const std::int64_t earliest = last_time_.value_or(0);
  if (time + offset_ < earliest) offset_ = earliest - time;
  last_time_ = time + offset_;
  return *last_time_;
}

void CameraRecorder::put(std::vector<Message> messages, const std::stop_token& stop) {
  std::size_t bytes = 0;
  for (const Message& message : messages) bytes += message.content.size();
  std::unique_lock lock(mutex_);
  const auto has_room = [&] {
    return waiting_.empty() || waiting_bytes_ + bytes <= options_.waiting_bytes || !failure_.empty() ||
           is_closed_;
  };
  if (options_.waits_for_disk) changed_.wait(lock, stop, has_room);
  if (!failure_.empty() || is_closed_) return;
  if (!has_room()) {
    lost_ += messages.size();
    return;
  }
  if (!last_time_ && !messages.empty())
    for (Message& message : described(next_time(messages.front().time)))
      waiting_.push_back(std::move(message));
  for (Message& message : messages) {
    message.time = next_time(message.time);
    waiting_bytes_ += message.content.size();
    waiting_.push_back(std::move(message));
  }
  changed_.notify_all();
}

void CameraRecorder::write_waiting(const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point flushed = Clock::now();
  bool is_flushed = true;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait_for(lock, stop, kFlush, [&] { return !waiting_.empty(); });
    if (waiting_.empty() && stop.stop_requested()) return;  // all is written
    std::optional<Message> message;
    if (!waiting_.empty()) {
      message = std::move(waiting_.front());
      waiting_.pop_front();
    }
    lock.unlock();
    std::string failure;
    try {
      if (message) write(*message);
      is_flushed &= !message;
      if (!is_flushed && Clock::now() - flushed >= kFlush) {
        writer_->flush();
        flushed = Clock::now();
        is_flushed = true;
      }
    } catch (const std::exception& error) {
      failure = error.what();
    }
    lock.lock();
    if (message) waiting_bytes_ -= std::min(waiting_bytes_, message->content.size());
    bytes_ = writer_->bytes();
    if (!failure.empty()) {
      failure_ = failure;
      waiting_.clear();
      waiting_bytes_ = 0;
    }
    changed_.notify_all();
  }
}

void CameraRecorder::write(const Message& message) {
  const auto [id, is_new] = ids_.try_emplace(message.topic, -1);
  if (is_new) {
    const TopicName& topic = kTopics[static_cast<std::size_t>(message.topic)];
    id->second = writer_->add_topic(topic.name, topic.type, ros_definition(topic.type));
  }
  writer_->write(id->second, message.time, message.content);
}

void CameraRecorder::close() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    is_closed_ = true;
  }
  thread_.request_stop();
  thread_.join();
  if (!failure_.empty()) throw OutputError(failure_);
  writer_->close();
  bytes_ = writer_->bytes();
}

std::size_t CameraRecorder::lost() const {
  const std::scoped_lock lock(mutex_);
  return lost_;
}

bool CameraRecorder::has_failed() const {
  const std::scoped_lock lock(mutex_);
  return !failure_.empty();
}

std::uint64_t CameraRecorder::bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

}  // namespace roslam
