// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/camera_connection.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace roslam {

namespace {
using std::chrono::milliseconds;

constexpr milliseconds kWait{100};  // for samples, so that an interrupt is noticed
constexpr int kFpsOfUsb2 = 15;

std::optional<DepthCameraDevice> with_serial(const std::vector<DepthCameraDevice>& devices,
                                             const std::string& serial) {
  const auto found = std::find_if(devices.begin(), devices.end(),
                                  [&](const auto& device) { return device.serial == serial; });
  return found == devices.end() ? std::nullopt : std::optional(*found);
}
}  // namespace

void LiveSourceOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw OptionsError(what);
  };
  require(mode.width >= 64 && mode.width <= 4096 && mode.height >= 64 && mode.height <= 4096,
          "the size of a camera's images must be from 64 to 4096 pixels a side");
  require(mode.fps >= 1 && mode.fps <= 300, "the rate of a camera must be from 1 to 300 images a second");
  constexpr milliseconds kLeast{1};
  require(silence >= kWait && first_image >= kWait && retry >= kLeast && after_reset >= kLeast,
          "a camera must be waited for at least 100 ms, and tried again after at least 1 ms");
  require(attempts_before_reset >= 1, "a camera must be tried at least once before it is reset");
}

CameraConnection::CameraConnection(std::unique_ptr<DepthCamera> driver, const LiveSourceOptions& options)
    : driver_(std::move(driver)), options_(options) {
  options_.validate();
  device_ = find();
  options_.serial = device_.serial;
  open_first();
  calibration_ = driver_->calibration();
}

CameraConnection::~CameraConnection() {
  if (worker_.joinable()) worker_.join();
  driver_->close();
}

DepthCameraDevice CameraConnection::find() const {
  const auto devices = driver_->devices();
  std::string connected;
  for (const auto& device : devices) connected += (connected.empty() ? "" : ", ") + in_words(device);
  const std::string camera = driver_->kind() + (options_.serial.empty() ? "" : ":" + options_.serial);
  if (devices.empty())
    throw InputError(camera +
                     ": no camera is connected; check the cable, the udev rules and whether another program "
                     "uses it (roslam camera list)");
  if (options_.serial.empty()) {
    if (devices.size() == 1) return devices.front();
    throw InputError(camera +
                     ": several cameras are connected; choose one by its serial number: " + connected);
  }
  if (const auto found = with_serial(devices, options_.serial)) return *found;
  throw InputError(camera + ": no camera of that serial number is connected; there is " + connected);
}

DepthCameraMode CameraConnection::mode_for(const DepthCameraDevice& device) const {
  DepthCameraMode mode = options_.mode;
  if (device.is_usb2()) mode.fps = std::min(mode.fps, kFpsOfUsb2);
  return mode;
}

// In the mode that was asked for, or in one that more cameras have.
void CameraConnection::open_first() {
  mode_ = mode_for(device_);
  if (mode_ != options_.mode)
    ++notes_["the camera is connected by USB 2 and gives fewer images a second; use a USB 3 cable and port"];
  try {
    driver_->open(device_.serial, mode_);
  } catch (const CameraLost&) {
    throw;
  } catch (const InputError&) {
    if (mode_.fps <= kFpsOfUsb2) throw;
    mode_.fps = kFpsOfUsb2;
    driver_->open(device_.serial, mode_);
    options_.mode = mode_;
    ++notes_["the camera does not have the mode that was asked for, and gives fewer images a second"];
  }
  is_open_ = true;
  openings_ = 1;
}

std::vector<CameraSample> CameraConnection::wait() {
  if (!is_open_) {
    reconnect();
    return {};
  }
  try {
    return driver_->wait(kWait);
  } catch (const CameraLost& error) {
    lose(error.what());
    return {};
  }
}

void CameraConnection::lose(const std::string& why) {
  if (!is_open_) return;
  is_open_ = false;  // the next attempt closes it
  failures_ = 0;
  why_lost_ = why;
  ++notes_["the camera was lost"];
}

void CameraConnection::reconnect() {
  if (!worker_.joinable()) {
    if (!pause(was_reset_ ? options_.after_reset : options_.retry)) return;
    const bool resets = failures_ >= options_.attempts_before_reset;
    worker_ = std::jthread([this, resets] {
      Outcome outcome = attempt(resets);
      const std::scoped_lock lock(mutex_);
      outcome_ = std::move(outcome);
      wake_.notify_all();
    });
  }
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [&] { return is_interrupted_ || outcome_; });
  const auto outcome = std::exchange(outcome_, std::nullopt);
  lock.unlock();
  if (!outcome) return;
  worker_.join();
  take(*outcome);
}

// On the thread of worker_.
CameraConnection::Outcome CameraConnection::attempt(bool resets) noexcept {
  Outcome outcome;
  try {
    driver_->close();
    if (resets) {
      driver_->reset(device_.serial);
      outcome.is_reset = true;
      return outcome;
    }
    const auto found = with_serial(driver_->devices(), device_.serial);
    outcome.is_there = found.has_value();
    if (!found) {
      outcome.why = "it is not connected";
      return outcome;
    }
    outcome.device = *found;
    outcome.mode = mode_for(*found);
    driver_->open(device_.serial, outcome.mode);
    outcome.is_open = true;
  } catch (const std::exception& error) {
    outcome.why = error.what();
  }
  return outcome;
}

void CameraConnection::take(const Outcome& outcome) {
  was_reset_ = outcome.is_reset;
  if (!outcome.why.empty()) why_lost_ = outcome.why;
  if (outcome.is_reset) {
    ++notes_["the camera was reset, as it could not be opened"];
    failures_ = 0;
  } else if (outcome.is_open) {
    device_ = outcome.device;
    mode_ = outcome.mode;
    is_open_ = true;
    ++openings_;
    ++notes_["the camera was opened again"];
  } else if (outcome.is_there) {
    ++failures_;
  }
}

void CameraConnection::interrupt() {
  const std::scoped_lock lock(mutex_);
  is_interrupted_ = true;
  wake_.notify_all();
}

bool CameraConnection::take_interrupt() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(is_interrupted_, false);
}

// False if it was interrupted.
bool CameraConnection::pause(milliseconds duration) {
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, duration, [&] { return is_interrupted_; });
}

}  // namespace roslam
