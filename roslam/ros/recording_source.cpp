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
constexpr std::size_t kMostWaiting = 60;  // images of a topic
constexpr double kRestartSeconds = 1.0;   // as kClockRestart, of inertial samples and true poses
constexpr std::int64_t kClockRestart =
    1'000'000'000;                                // nanoseconds back, from which a clock may have begun anew
constexpr std::int64_t kOutlier = 5'000'000'000;  // that a clock may go on after a stamp that was none
constexpr const char* kBack = "image whose time stamp is not after that of the one before";
constexpr std::size_t kMostInertial = 4000;  // samples that may wait for an image
constexpr std::size_t kMostPoses = 20000;

// The newest images, and what is a restart later, come last.
template <typename Image>
std::pair<int, std::int64_t> order_of(const Image& image) {
  return {image.segment, image.stamp};
}

std::int64_t distance(std::int64_t a, std::int64_t b) { return a < b ? b - a : a - b; }
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
  half_interval_ = static_cast<std::int64_t>(0.5e9 / (rate > 0.0 ? rate : streams_.camera.fps));
  std::set<int> topics{streams_.colour.topic.id, streams_.depth.topic.id};
  for (const RecordedTopic& topic : streams_.inertial) topics.insert(topic.id);
  if (streams_.truth) topics.insert(streams_.truth->id);
  recording_->select(topics);
}

RecordingSource::~RecordingSource() = default;

std::optional<Frame> RecordingSource::next() {
  while (true) {
    while (!is_decided() && read_message()) {
    }
    if (colour_.images.empty()) return std::nullopt;
    const Waiting colour = std::move(colour_.images.front());
    colour_.images.pop_front();
    if (auto frame = frame_of(colour, take_depth(colour))) return frame;
  }
}

// Whether the depth image of the first colour image that waits is known: one as late as could belong to it
// has come, and so has the next colour image, to which it may belong instead.
bool RecordingSource::is_decided() const {
  if (colour_.images.empty()) return false;
  if (is_at_end_ || colour_.images.size() >= kMostWaiting || depth_.images.size() >= kMostWaiting)
    return true;
  const Waiting& colour = colour_.images.front();
  const bool has_depth =
      !depth_.images.empty() &&
      order_of(depth_.images.back()) > std::pair(colour.segment, colour.stamp + half_interval_);
  return has_depth && colour_.images.size() > 1;
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
      put(streams_.colour, message->data, colour_, skipped_);
    } else if (topic == streams_.depth.topic.id) {
      put(streams_.depth, message->data, depth_, skipped_depth_);
    } else if (streams_.truth && topic == streams_.truth->id) {
      add_truth(message->data);
    } else {
      for (const RecordedTopic& inertial : streams_.inertial)
        if (inertial.id == topic) add_inertial(inertial, message->data);
    }
  } catch (const InputError& error) {
    auto& counts = topic == streams_.colour.topic.id  ? skipped_
                   : topic == streams_.depth.topic.id ? skipped_depth_
                                                      : notes_;
    ++counts[error.what()];
  }
  return true;
}

// A clock that goes back has restarted if the next image confirms it; a single image from the future or the
// past does not count.
void RecordingSource::put(const RecordedImages& images, std::span<const std::uint8_t> message, Queue& queue,
                          std::map<std::string, std::size_t>& skipped) {
  Waiting image;
  image.index = queue.count++;
  image.stamp = decode_image_of(images, message, is_realsense_).header.stamp;
  image.message.assign(message.begin(), message.end());
  auto candidate = std::exchange(queue.candidate, std::nullopt);
  if (!queue.last || image.stamp > *queue.last) {
    if (candidate) ++skipped[kBack];
    return accept(std::move(image), queue, skipped);
  }
  if (*queue.last - image.stamp < kClockRestart) {
    queue.candidate = std::move(candidate);
    ++skipped[kBack];
  } else if (queue.before && image.stamp > *queue.before && image.stamp - *queue.before < kOutlier) {
    ++skipped["image with an implausible time stamp"];
    if (!queue.images.empty() && queue.images.back().stamp == *queue.last) queue.images.pop_back();
    queue.last = queue.before;
    accept(std::move(image), queue, skipped);
  } else if (candidate && image.stamp > candidate->stamp) {
    ++queue.segment;
    if (&queue == &colour_) ++notes_["the clock restarts; a new segment begins there"];
    queue.last.reset();
    accept(std::move(*candidate), queue, skipped);
    accept(std::move(image), queue, skipped);
  } else {
    if (candidate) ++skipped[kBack];
    queue.candidate = std::move(image);
  }
}

void RecordingSource::accept(Waiting image, Queue& queue, std::map<std::string, std::size_t>& skipped) {
  // A step back of about a second may be a restart to one of the streams only.
  const Queue& other = &queue == &colour_ ? depth_ : colour_;
  const bool is_near = other.last && distance(image.stamp, *other.last) < kClockRestart;
  if (queue.segment < other.segment && is_near) queue.segment = other.segment;
  image.segment = queue.segment;
  queue.before = std::exchange(queue.last, image.stamp);
  queue.images.push_back(std::move(image));
  if (queue.images.size() <= kMostWaiting) return;
  ++skipped["no image near in time"];
  queue.images.pop_front();
}

// The depth image nearest in time that is not nearer to the next colour image.
std::optional<RecordingSource::Waiting> RecordingSource::take_depth(const Waiting& colour) {
  auto& depths = depth_.images;
  while (!depths.empty() &&
         order_of(depths.front()) < std::pair(colour.segment, colour.stamp - half_interval_)) {
    passed_depth_ = order_of(depths.front());
    depths.pop_front();
  }
  const auto is_near = [&](const Waiting& depth) {
    return depth.segment == colour.segment && distance(depth.stamp, colour.stamp) <= half_interval_;
  };
  auto nearest = depths.end();
  for (auto depth = depths.begin(); depth != depths.end(); ++depth) {
    if (!is_near(*depth)) continue;
    if (nearest == depths.end() ||
        distance(depth->stamp, colour.stamp) < distance(nearest->stamp, colour.stamp))
      nearest = depth;
  }
  if (nearest != depths.end() && !colour_.images.empty()) {
    const Waiting& next = colour_.images.front();
    if (next.segment == colour.segment &&
        distance(nearest->stamp, next.stamp) < distance(nearest->stamp, colour.stamp))
      nearest = depths.end();
  }
  if (nearest == depths.end()) return std::nullopt;
  passed_depth_ = order_of(*nearest);
  std::optional<Waiting> taken = std::move(*nearest);
  depths.erase(depths.begin(), std::next(nearest));
  return taken;
}

// How far the nearest depth image is from a colour image that has none.
void RecordingSource::add_missing_depth(const Waiting& colour) {
  std::optional<std::int64_t> nearest;
  const auto offer = [&](const std::pair<int, std::int64_t>& depth) {
    if (depth.first != colour.segment) return;
    const std::int64_t apart = distance(depth.second, colour.stamp);
    nearest = std::min(apart, nearest.value_or(apart));
  };
  if (passed_depth_) offer(*passed_depth_);
  for (const Waiting& depth : depth_.images) offer(order_of(depth));
  missing_depth_.add(nearest, half_interval_);
}

std::map<std::string, std::size_t> RecordingSource::skipped_depth() const {
  auto skipped = skipped_depth_;
  missing_depth_.add_to(skipped);
  return skipped;
}

std::optional<Frame> RecordingSource::frame_of(const Waiting& colour, const std::optional<Waiting>& depth) {
  Frame frame;
  frame.index = colour.index;
  frame.segment = colour.segment;
  frame.timestamp = seconds_of(colour.stamp);
  try {
    frame.colour = colour_pixels(decode_image_of(streams_.colour, colour.message, is_realsense_));
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
  if (depth) {
    frame.depth = depth_image(*depth);
  } else {
    add_missing_depth(colour);
  }
  take_inertial(frame);
  frame.T_world_camera = truth_at(frame.timestamp);
  return frame;
}

cv::Mat RecordingSource::depth_image(const Waiting& depth) {
  try {
    std::size_t saturated = 0;
    const double units =
        streams_.camera.depth_units_per_metre > 0.0 ? streams_.camera.depth_units_per_metre : 1.0;
    const cv::Mat metres =
        depth_pixels(decode_image_of(streams_.depth, depth.message, is_realsense_), units, &saturated);
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

// A gyroscope of its own, whose samples come more often, is given the last acceleration.
void RecordingSource::add_inertial(const RecordedTopic& topic, std::span<const std::uint8_t> message) {
  const RosImu imu = decode_imu(message, encoding_of(topic));
  const double time = seconds_of(imu.header.stamp);
  if (!inertial_.empty() && time < inertial_.back().timestamp - kRestartSeconds) inertial_.clear();
  const bool is_pair = streams_.inertial.size() > 1;
  if (is_pair && topic.id == streams_.inertial.front().id) {  // the accelerometer
    acceleration_ = imu.acceleration;
    return;
  }
  if (is_pair && !acceleration_) return;
  inertial_.push_back({time, imu.turn_rate, is_pair ? *acceleration_ : imu.acceleration});
  if (inertial_.size() > kMostInertial) inertial_.pop_front();
}

void RecordingSource::take_inertial(Frame& frame) {
  while (!inertial_.empty() && inertial_.front().timestamp <= frame.timestamp) {
    frame.inertial.push_back(inertial_.front());
    inertial_.pop_front();
  }
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
  notes.insert(streams_.notes.begin(), streams_.notes.end());
  for (const auto& [note, number] : recording_->notes()) notes[note] += number;
  if (streams_.truth && is_at_end_ && !T_child_camera_)
    ++notes["no ground truth was found in " + streams_.truth->name];
  count(notes, "depth pixel at the end of the sensor's range, taken as unknown", saturated_);
  return notes;
}

}  // namespace roslam
