// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/recording_source.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam {

namespace {
constexpr double kRestartSeconds = 1.0;  // by which the clock of true poses goes back
constexpr std::size_t kMostPoses = 20000;
}  // namespace

RecordingSource::RecordingSource(const std::filesystem::path& path, const RecordingChoice& choice,
                                 const std::optional<Camera>& camera, const std::optional<SE3>& T_body_camera)
    : recording_(open_recording(path)) {
  const RecordingContents contents = contents_of(*recording_);
  is_realsense_ = contents.is_realsense;
  streams_ = choose_streams(contents, choice, camera, path.string());
  if (T_body_camera) streams_.camera.T_body_camera = *T_body_camera;
  if (streams_.T_colour_depth) {
    registration_.emplace(streams_.depth_camera, streams_.camera, *streams_.T_colour_depth);
    ++notes_["depth images are registered to colour by the calibrations of the recording"];
  }
  const double rate = streams_.colour.rate();
  StreamPairingOptions pairing;
  pairing.half_interval = static_cast<std::int64_t>(0.5e9 / (rate > 0.0 ? rate : streams_.camera.fps));
  pairing_ = Pairing(pairing);
  std::set<int> topics{streams_.colour.topic.id, streams_.depth.topic.id};
  for (const RecordedTopic& topic : streams_.inertial) topics.insert(topic.id);
  if (streams_.truth) topics.insert(streams_.truth->id);
  recording_->select(topics);
}

RecordingSource::~RecordingSource() = default;

std::optional<Frame> RecordingSource::next() {
  while (true) {
    auto images = pairing_.take(is_at_end_);
    if (!images && is_at_end_) return std::nullopt;
    if (!images) {
      read_message();
    } else if (auto frame = frame_of(*images)) {
      return frame;
    }
  }
}

std::map<std::string, std::size_t> RecordingSource::skipped() const {
  return sum(skipped_, pairing_.skipped_colour());
}

std::map<std::string, std::size_t> RecordingSource::skipped_depth() const {
  auto skipped = sum(skipped_depth_, pairing_.skipped_depth());
  missing_depth_.add_to(skipped);
  return skipped;
}

bool RecordingSource::read_message() {
  const auto message = recording_->next();
  if (!message) {
    is_at_end_ = true;
    return false;
  }
  const int topic = message->topic;
  try {
    if (topic == streams_.colour.topic.id) {
      pairing_.add_colour(stamp_of(streams_.colour, message->data),
                          {message->data.begin(), message->data.end()});
    } else if (topic == streams_.depth.topic.id) {
      pairing_.add_depth(stamp_of(streams_.depth, message->data),
                         {message->data.begin(), message->data.end()});
    } else if (streams_.truth && topic == streams_.truth->id) {
      add_truth(message->data);
    } else {
      for (const RecordedTopic& inertial : streams_.inertial)
        if (inertial.id == topic) add_inertial(inertial, message->data);
    }
  } catch (const InputError& error) {
    if (topic == streams_.colour.topic.id) pairing_.skip_colour();
    auto& counts = topic == streams_.colour.topic.id  ? skipped_
                   : topic == streams_.depth.topic.id ? skipped_depth_
                                                      : notes_;
    ++counts[error.what()];
  }
  return true;
}

std::int64_t RecordingSource::stamp_of(const RecordedImages& images,
                                       std::span<const std::uint8_t> message) const {
  return decode_image_of(images, message, is_realsense_).header.stamp;
}

std::optional<Frame> RecordingSource::frame_of(const Pairing::Pair& images) {
  const Pairing::Image& colour = images.colour;
  Frame frame;
  frame.index = colour.index;
  frame.segment = colour.segment;
  frame.timestamp = seconds_of(colour.stamp);
  try {
    frame.colour = colour_pixels(decode_image_of(streams_.colour, colour.content, is_realsense_));
  } catch (const InputError& error) {
    ++skipped_[error.what()];
    return std::nullopt;
  }
  const cv::Size expected(streams_.camera.width, streams_.camera.height);
  if (frame.colour.size() != expected) {
    ++skipped_["colour image is " + size_in_words(frame.colour.size()) + " but the camera " +
               size_in_words(expected) + " pixels"];
    return std::nullopt;
  }
  if (images.depth) {
    frame.depth = depth_image(*images.depth);
  } else {
    missing_depth_.add(images.nearest, pairing_.options().half_interval);
  }
  frame.inertial = inertial_.take_until(frame.timestamp, frame.segment);
  frame.T_world_camera = truth_at(frame.timestamp);
  return frame;
}

cv::Mat RecordingSource::depth_image(const Pairing::Image& depth) {
  try {
    std::size_t saturated = 0;
    const double units =
        streams_.camera.depth_units_per_metre > 0.0 ? streams_.camera.depth_units_per_metre : 1.0;
    const cv::Mat metres =
        depth_pixels(decode_image_of(streams_.depth, depth.content, is_realsense_), units, &saturated);
    saturated_ += saturated;
    const cv::Size expected(streams_.depth_camera.width, streams_.depth_camera.height);
    if (metres.size() != expected)
      throw InputError("depth image is " + size_in_words(metres.size()) + " but its camera " +
                       size_in_words(expected) + " pixels");
    return registration_ ? (*registration_)(metres) : metres;
  } catch (const InputError& error) {
    ++skipped_depth_[error.what()];
    return {};
  }
}

void RecordingSource::add_inertial(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
  const RosImu imu = decode_imu(message, encoding_of(topic));
  const double time = seconds_of(imu.header.stamp);
  if (streams_.inertial.size() == 1)
    inertial_.add({time, imu.turn_rate, imu.acceleration});
  else if (topic.id == streams_.inertial.front().id)  // the accelerometer
    inertial_.add_acceleration(imu.acceleration);
  else
    inertial_.add_turn_rate(time, imu.turn_rate);
}

void RecordingSource::add_truth(std::span<const std::uint8_t> message) {
  const auto transforms =
      decode_transforms(plain_type(streams_.truth->type), message, encoding_of(*streams_.truth));
  for (const RosTransform& transform : transforms.value_or(std::vector<RosTransform>{})) {
    if (!streams_.truth_child.empty() && plain_frame(transform.child) != plain_frame(streams_.truth_child))
      continue;
    const double time = seconds_of(transform.header.stamp);
    if (!truth_.empty() && time < truth_.back().timestamp - kRestartSeconds) truth_.clear();
    if (!truth_.empty() && time <= truth_.back().timestamp) continue;
    truth_.push_back({time, transform.T_parent_child * place_camera(transform.child)});
    if (truth_.size() > kMostPoses) truth_.pop_front();
  }
}

// Where the camera is in the frame that ground truth is of; as told by the first message.
const SE3& RecordingSource::place_camera(const std::string& child) {
  if (T_child_camera_) return *T_child_camera_;
  if (!child.empty()) T_child_camera_ = streams_.frames.transform(child, streams_.colour.frame);
  if (!T_child_camera_) {
    T_child_camera_ = SE3();
    ++notes_["ground truth of " + streams_.truth->name + " is taken as the pose of the camera"];
  }
  return *T_child_camera_;
}

std::optional<SE3> RecordingSource::truth_at(double timestamp) {
  while (truth_.size() > 1 && truth_[1].timestamp <= timestamp) truth_.pop_front();
  const auto around = std::min<std::size_t>(truth_.size(), 2);
  const Trajectory poses(truth_.begin(), truth_.begin() + static_cast<std::ptrdiff_t>(around));
  return true_pose_at(poses, timestamp);
}

std::map<std::string, std::size_t> RecordingSource::notes() const {
  auto notes = notes_;
  count(notes, "the clock restarts; a new segment begins there",
        static_cast<std::size_t>(pairing_.restarts()));
  notes.insert(streams_.notes.begin(), streams_.notes.end());
  notes = sum(std::move(notes), recording_->notes());
  if (streams_.truth && is_at_end_ && !T_child_camera_)
    ++notes["no ground truth was found in " + streams_.truth->name];
  count(notes, "depth pixel at the end of the sensor's range, taken as unknown", saturated_);
  return notes;
}

}  // namespace roslam
