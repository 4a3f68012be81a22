// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/live_source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "roslam/ros/ros_messages.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam {

namespace {
using std::chrono::milliseconds;

constexpr milliseconds kWait{100};          // for samples, so that an interrupt is noticed
constexpr milliseconds kClocksAgree{2000};  // after opening; until then a camera may change its clock
constexpr int kFpsOfUsb2 = 15;
constexpr std::size_t kMostWaiting = 4;  // images: more would be latency

bool is_image(const CameraSample& sample) {
  return sample.stream == CameraStream::kColour || sample.stream == CameraStream::kDepth;
}

std::string name_of(const DepthCameraDevice& device) {
  return device.name + " (" + device.serial + (device.usb.empty() ? "" : ", USB " + device.usb) + ")";
}

// Of cameras of its kind.
std::optional<DepthNoise> usual_noise(const DepthCameraDevice& device) {
  for (const auto& [part, preset] : {std::pair("D43", "d435"), std::pair("D45", "d455")})
    if (device.name.find(part) != std::string::npos) return camera_preset(preset)->depth_noise;
  return std::nullopt;
}

void merge(const Counts& counts, Counts& to) {
  for (const auto& [reason, number] : counts) to[reason] += number;
}
}  // namespace

void LiveSourceOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw OptionsError(what);
  };
  require(mode.width >= 64 && mode.width <= 4096 && mode.height >= 64 && mode.height <= 4096,
          "the size of a camera's images must be from 64 to 4096 pixels a side");
  require(mode.fps >= 1 && mode.fps <= 300, "the rate of a camera must be from 1 to 300 images a second");
  require(silence >= milliseconds(100) && first_image >= milliseconds(100) && retry >= milliseconds(1),
          "a camera must be waited for at least 100 ms, and tried again after at least 1 ms");
  require(attempts_before_reset >= 1, "a camera must be tried at least once before it is reset");
}

LiveSource::LiveSource(std::unique_ptr<DepthCamera> camera, const LiveSourceOptions& options,
                       const std::optional<SE3>& T_body_camera)
    : driver_(std::move(camera)), options_(options), T_body_camera_(T_body_camera), created_(Clock::now()) {
  options_.validate();
  device_ = find_device();
  options_.serial = device_.serial;
  open();
  StreamPairingOptions pairing;
  pairing.half_interval = static_cast<std::int64_t>(0.5e9 / calibration_.colour.fps);
  pairing.most_waiting = kMostWaiting;
  pairing.takes_close_at_once = true;
  pairing_ = Pairing(pairing);
}

LiveSource::~LiveSource() { driver_->close(); }

DepthCameraDevice LiveSource::find_device() const {
  const auto devices = driver_->devices();
  std::string connected;
  for (const auto& device : devices) connected += (connected.empty() ? "" : ", ") + name_of(device);
  const std::string camera = driver_->kind() + (options_.serial.empty() ? "" : ":" + options_.serial);
  if (devices.empty())
    throw InputError(camera + ": no camera is connected; check the cable, the udev rules and " +
                     "whether another program uses it (roslam camera list)");
  if (options_.serial.empty()) {
    if (devices.size() == 1) return devices.front();
    throw InputError(camera +
                     ": several cameras are connected; choose one by its serial number: " + connected);
  }
  const auto found = std::find_if(devices.begin(), devices.end(),
                                  [&](const auto& device) { return device.serial == options_.serial; });
  if (found != devices.end()) return *found;
  throw InputError(camera + ": no camera of that serial number is connected; there is " + connected);
}

// Opens the device in the mode that was asked for, or in one that USB 2 can carry.
void LiveSource::open() {
  DepthCameraMode mode = options_.mode;
  DepthCameraMode slower = mode;
  slower.fps = std::min(mode.fps, kFpsOfUsb2);
  if (device_.is_usb2() && slower != mode) {
    ++notes_["the camera is connected by USB 2 and gives fewer images a second; use a USB 3 cable and port"];
    mode = slower;
  }
  try {
    open_in(mode);
  } catch (const CameraLost&) {
    throw;
  } catch (const InputError&) {
    if (slower == mode) throw;
    open_in(slower);
    ++notes_["the camera does not have the mode that was asked for, and gives fewer images a second"];
  }
}

void LiveSource::open_in(DepthCameraMode mode) {
  driver_->open(device_.serial, mode);
  is_open_ = true;
  opened_ = last_image_ = Clock::now();
  settling_.restart();
  numbers_.clear();
  clocks_.clear();
  DepthCameraCalibration calibration = driver_->calibration();
  if (has_frame_ || registration_) return;  // it is the same camera
  calibration_ = std::move(calibration);
  calibration_.colour.fps = mode.fps;
  double& units = calibration_.colour.depth_units_per_metre;
  const double whole = std::round(units);
  if (std::abs(units - whole) < 1e-4 * whole)
    units = whole;  // a driver may have them as the inverse of a float
  if (!calibration_.colour.depth_noise) calibration_.colour.depth_noise = usual_noise(device_);
  if (T_body_camera_) calibration_.colour.T_body_camera = *T_body_camera_;
  calibration_.colour.validate();
  registration_.emplace(calibration_.depth, calibration_.colour, calibration_.T_colour_depth);
}

std::optional<Frame> LiveSource::next() {
  while (!take_interrupt()) {
    if (auto images = pairing_.take()) {
      auto frame = frame_of(std::move(*images));
      if (!frame) continue;
      has_frame_ = true;
      return frame;
    }
    is_open_ ? receive() : come_back();
  }
  return std::nullopt;
}

void LiveSource::interrupt() {
  const std::scoped_lock lock(mutex_);
  is_interrupted_ = true;
  wake_.notify_all();
}

bool LiveSource::take_interrupt() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(is_interrupted_, false);
}

// False if it was interrupted.
bool LiveSource::pause(milliseconds duration) {
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, duration, [&] { return is_interrupted_; });
}

void LiveSource::receive() {
  try {
    for (CameraSample& sample : driver_->wait(kWait)) take(std::move(sample));
  } catch (const CameraLost& error) {
    return lose(error.what());
  }
  if (Clock::now() - last_image_ > options_.silence) lose("it gives no images");
  require_images();
}

void LiveSource::lose(const std::string& why) {
  driver_->close();
  is_open_ = false;
  failed_attempts_ = 0;
  why_lost_ = why;
  ++notes_["the camera was lost"];
}

// One attempt to open the camera again. The device needs a while until it is there.
void LiveSource::come_back() {
  require_images();
  if (!pause(options_.retry)) return;
  try {
    const auto devices = driver_->devices();
    const auto found = std::find_if(devices.begin(), devices.end(),
                                    [&](const auto& device) { return device.serial == device_.serial; });
    if (found == devices.end()) throw CameraLost("it is not connected");
    device_ = *found;
    open();
    ++notes_["the camera was opened again"];
  } catch (const InputError& error) {
    driver_->close();
    is_open_ = false;
    why_lost_ = error.what();
    if (++failed_attempts_ % options_.attempts_before_reset != 0) return;
    ++notes_["the camera was reset, as it could not be opened"];
    try {
      driver_->reset(device_.serial);
    } catch (const InputError&) {  // it is not there to be reset
    }
  }
}

// A camera that never gave an image is no reason to wait for ever.
void LiveSource::require_images() const {
  if (has_frame_ || Clock::now() - created_ < options_.first_image) return;
  throw InputError(name_of(device_) + ": the camera gave no image in " +
                   std::to_string(options_.first_image.count() / 1000) + " s" +
                   (why_lost_.empty() ? "" : " (" + why_lost_ + ")") +
                   "; check the cable, and whether another program uses it");
}

void LiveSource::take(CameraSample sample) {
  if (!is_image(sample)) return take_inertial(sample);
  last_image_ = Clock::now();
  count_missing(sample);
  const bool is_colour = sample.stream == CameraStream::kColour;
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

// Times of two clocks cannot be compared. A camera may begin with one clock and go over to another.
bool LiveSource::is_of_one_clock(const CameraSample& sample) {
  const bool is_colour = sample.stream == CameraStream::kColour;
  clocks_[sample.stream] = sample.clock;
  const auto other = clocks_.find(is_colour ? CameraStream::kDepth : CameraStream::kColour);
  if (other == clocks_.end() || other->second == sample.clock) return true;
  ++(is_colour ? skipped_ : skipped_depth_)["image that is stamped by another clock than its partner"];
  if (has_frame_ || Clock::now() - opened_ < kClocksAgree) return false;
  throw InputError(name_of(device_) + ": colour images are stamped by the clock '" +
                   clocks_[CameraStream::kColour] + "' and depth images by '" +
                   clocks_[CameraStream::kDepth] +
                   "', so that they cannot be paired; enable global time, or install the driver that gives "
                   "metadata to both");
}

void LiveSource::count_missing(const CameraSample& sample) {
  std::uint64_t& last = numbers_[sample.stream];
  constexpr std::uint64_t kMost = 10000;  // a longer step is a counter that begins anew
  if (last > 0 && sample.number > last + 1 && sample.number - last < kMost)
    notes_["image that the camera or its driver dropped"] += sample.number - last - 1;
  last = sample.number;
}

std::optional<Frame> LiveSource::frame_of(Pairing::Pair images) {
  Frame frame;
  frame.index = images.colour.index;
  frame.segment = images.colour.segment;
  frame.timestamp = seconds_of(images.colour.stamp);
  frame.received = images.colour.content.received;
  frame.colour = std::move(images.colour.content.pixels);
  const cv::Size expected(calibration_.colour.width, calibration_.colour.height);
  if (frame.colour.type() != CV_8UC3 || frame.colour.size() != expected) {
    ++skipped_["colour image is not of " + size_in_words(expected) + " pixels"];
    return std::nullopt;
  }
  if (images.depth) {
    frame.depth = registered(images.depth->content.pixels);
  } else {
    missing_depth_.add(images.nearest, pairing_.options().half_interval);
  }
  frame.inertial = inertial_.take_until(frame.timestamp, frame.segment);
  return frame;
}

cv::Mat LiveSource::registered(const cv::Mat& raw) {
  const cv::Size expected(calibration_.depth.width, calibration_.depth.height);
  if (raw.type() != CV_16UC1 || raw.size() != expected) {
    ++skipped_depth_["depth image is not of " + size_in_words(expected) + " pixels"];
    return {};
  }
  std::size_t saturated = 0;
  const cv::Mat metres = depth_to_metres(raw, calibration_.colour.depth_units_per_metre, &saturated);
  count(notes_, "depth pixel at the end of the sensor's range, taken as unknown", saturated);
  return (*registration_)(metres);
}

Counts LiveSource::skipped() const {
  Counts counts = skipped_;
  merge(pairing_.skipped_colour(), counts);
  return counts;
}

Counts LiveSource::skipped_depth() const {
  Counts counts = skipped_depth_;
  merge(pairing_.skipped_depth(), counts);
  missing_depth_.add_to(counts);
  return counts;
}

}  // namespace roslam
