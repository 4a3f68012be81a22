// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/live_source.hpp"

#include <cmath>
#include <utility>

#include "roslam/cameras/camera_connection.hpp"
#include "roslam/common/timestamp.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam {

namespace {
using std::chrono::milliseconds;

constexpr milliseconds kClocksAgree{2000};  // until then a camera may change its clock
constexpr std::size_t kMostWaiting = 4;     // images: more would be latency

bool is_image(const CameraSample& sample) {
  return sample.stream == CameraStream::kColour || sample.stream == CameraStream::kDepth;
}

// Of cameras of its kind.
std::optional<DepthNoise> usual_noise(const DepthCameraDevice& device) {
  for (const auto& [part, preset] : {std::pair("D43", "d435"), std::pair("D45", "d455")})
    if (device.name.find(part) != std::string::npos) return camera_preset(preset)->depth_noise;
  return std::nullopt;
}

DepthCameraCalibration calibration_of(const CameraConnection& connection,
                                      const std::optional<SE3>& T_body_camera) {
  DepthCameraCalibration calibration = connection.calibration();
  Camera& colour = calibration.colour;
  colour.fps = connection.mode().fps;
  const double whole = std::round(colour.depth_units_per_metre);
  // A driver may have the units as the inverse of a float.
  if (std::abs(colour.depth_units_per_metre - whole) < 1e-4 * whole) colour.depth_units_per_metre = whole;
  if (!colour.depth_noise) colour.depth_noise = usual_noise(connection.device());
  if (T_body_camera) colour.T_body_camera = *T_body_camera;
  colour.validate();
  return calibration;
}

StreamPairingOptions pairing_options(double fps) {
  StreamPairingOptions options;
  options.half_interval = static_cast<std::int64_t>(0.5e9 / fps);
  options.most_waiting = kMostWaiting;
  options.takes_close_at_once = true;
  return options;
}
}  // namespace

LiveSource::LiveSource(std::unique_ptr<DepthCamera> camera, const LiveSourceOptions& options,
                       const std::optional<SE3>& T_body_camera)
    : connection_(std::make_unique<CameraConnection>(std::move(camera), options)),
      options_(options),
      calibration_(calibration_of(*connection_, T_body_camera)),
      registration_(calibration_.depth, calibration_.colour, calibration_.T_colour_depth),
      pairing_(pairing_options(calibration_.colour.fps)),
      created_(Clock::now()) {
  begin_opening();
}

LiveSource::~LiveSource() = default;

const DepthCameraDevice& LiveSource::device() const { return connection_->device(); }

void LiveSource::begin_opening() {
  openings_ = connection_->openings();
  last_colour_ = last_depth_ = clocks_agreed_ = Clock::now();
  settling_.restart();
  last_.clear();
  clocks_.clear();
}

std::optional<Frame> LiveSource::next() {
  while (!connection_->take_interrupt()) {
    if (auto images = pairing_.take()) {
      has_frame_ = true;
      return frame_of(std::move(*images));
    }
    if (received_.empty()) {
      receive();
    } else {
      CameraSample sample = std::move(received_.front());
      received_.pop_front();
      take(std::move(sample));
    }
  }
  return std::nullopt;
}

void LiveSource::interrupt() { connection_->interrupt(); }

void LiveSource::receive() {
  for (CameraSample& sample : connection_->wait()) received_.push_back(std::move(sample));
  if (connection_->openings() != openings_) begin_opening();
  const Clock::time_point now = Clock::now();
  if (now - last_colour_ > options_.silence) connection_->lose("it gives no colour images");
  if (has_depth_ && now - last_depth_ > options_.silence) connection_->lose("it gives no depth images");
  require_images();
}

// A camera that never gave an image is no reason to wait for ever.
void LiveSource::require_images() const {
  if ((has_frame_ && has_depth_) || Clock::now() - created_ < options_.first_image) return;
  const std::string& why = connection_->why_lost();
  throw InputError(in_words(device()) + ": the camera gave no " + (has_frame_ ? "depth " : "") + "image in " +
                   std::to_string(options_.first_image.count() / 1000) + " s" +
                   (why.empty() ? "" : " (" + why + ")") +
                   "; check the cable, and whether another program uses it");
}

void LiveSource::take(CameraSample sample) {
  if (!is_image(sample)) return take_inertial(sample);
  if (is_repeated(sample)) return;
  const bool is_colour = sample.stream == CameraStream::kColour;
  (is_colour ? last_colour_ : last_depth_) = Clock::now();
  has_depth_ |= !is_colour;
  if (!has_right_pixels(sample)) return;
  if (is_colour ? !settling_.look_at(sample.pixels) : !settling_.is_settled()) {
    ++(is_colour ? skipped_ : skipped_depth_)["image while the exposure settles"];
    return;
  }
  if (!is_of_one_clock(sample)) return;
  if (on_sample_) on_sample_(sample);
  const std::int64_t stamp = sample.stamp;
  is_colour ? pairing_.add_colour(stamp, std::move(sample)) : pairing_.add_depth(stamp, std::move(sample));
}

void LiveSource::take_inertial(const CameraSample& sample) {
  if (!calibration_.colour.imu) return;
  const auto colour = clocks_.find(CameraStream::kColour);
  if (colour != clocks_.end() && colour->second != sample.clock) {
    ++notes_["inertial sample that is stamped by another clock than the images"];
    return;
  }
  if (on_sample_) on_sample_(sample);
  if (sample.stream == CameraStream::kAccelerometer)
    inertial_.add_acceleration(sample.vector);
  else
    inertial_.add_turn_rate(seconds_of(sample.stamp), sample.vector);
}

// Drivers may give the last image of a stream again, with a new one of the other. Counts what they left out.
bool LiveSource::is_repeated(const CameraSample& sample) {
  auto& last = last_[sample.stream];
  if (last == std::pair(sample.number, sample.stamp)) return true;
  const std::uint64_t before = std::exchange(last, {sample.number, sample.stamp}).first;
  constexpr std::uint64_t kMost = 10000;  // a longer step is a counter that begins anew
  if (before > 0 && sample.number > before + 1 && sample.number - before < kMost)
    notes_["image that the camera or its driver dropped"] += sample.number - before - 1;
  return false;
}

bool LiveSource::has_right_pixels(const CameraSample& sample) {
  const bool is_colour = sample.stream == CameraStream::kColour;
  const Camera& camera = is_colour ? calibration_.colour : calibration_.depth;
  const cv::Size expected(camera.width, camera.height);
  if (sample.pixels.type() == (is_colour ? CV_8UC3 : CV_16UC1) && sample.pixels.size() == expected)
    return true;
  ++(is_colour ? skipped_ : skipped_depth_)[std::string(is_colour ? "colour" : "depth") +
                                            " image is not of " + size_in_words(expected) + " pixels"];
  return false;
}

// Times of two clocks cannot be compared. A camera may begin with one clock and go over to another.
bool LiveSource::is_of_one_clock(const CameraSample& sample) {
  const bool is_colour = sample.stream == CameraStream::kColour;
  clocks_[sample.stream] = sample.clock;
  const auto other = clocks_.find(is_colour ? CameraStream::kDepth : CameraStream::kColour);
  if (other == clocks_.end() || other->second == sample.clock) {
    clocks_agreed_ = Clock::now();
    if (!clock_.empty() && clock_ != sample.clock) {
      ++notes_["the camera changed its clock; a new segment begins there"];
      pairing_.restart();
    }
    clock_ = sample.clock;
    return true;
  }
  ++(is_colour ? skipped_ : skipped_depth_)["image that is stamped by another clock than its partner"];
  if (Clock::now() - clocks_agreed_ < kClocksAgree) return false;
  if (has_frame_) {  // it was right before
    connection_->lose("colour and depth images are stamped by different clocks");
    return false;
  }
  throw InputError(in_words(device()) + ": colour images are stamped by the clock '" +
                   clocks_[CameraStream::kColour] + "' and depth images by '" +
                   clocks_[CameraStream::kDepth] +
                   "', so that they cannot be paired; enable global time, or install the driver that gives "
                   "metadata to both");
}

Frame LiveSource::frame_of(Pairing::Pair images) {
  Frame frame;
  frame.index = images.colour.index;
  frame.segment = images.colour.segment;
  frame.timestamp = seconds_of(images.colour.stamp);
  frame.received = images.colour.content.received;
  frame.colour = std::move(images.colour.content.pixels);
  if (images.depth) {
    std::size_t saturated = 0;
    const cv::Mat metres =
        depth_to_metres(images.depth->content.pixels, calibration_.colour.depth_units_per_metre, &saturated);
    count(notes_, "depth pixel at the end of the sensor's range, taken as unknown", saturated);
    frame.depth = registration_(metres);
  } else {
    missing_depth_.add(images.nearest, pairing_.options().half_interval);
  }
  frame.inertial = inertial_.take_until(frame.timestamp, frame.segment);
  return frame;
}

Counts LiveSource::skipped() const { return sum(skipped_, pairing_.skipped_colour()); }

Counts LiveSource::skipped_depth() const {
  Counts counts = sum(skipped_depth_, pairing_.skipped_depth());
  missing_depth_.add_to(counts);
  return counts;
}

Counts LiveSource::notes() const { return sum(notes_, connection_->notes()); }

}  // namespace roslam
