// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/live_camera.hpp"

#include <cstdio>
#include <filesystem>

#include "roslam/cameras/realsense_camera.hpp"
#include "roslam/common/formatted.hpp"
#include "roslam/geometry/mount.hpp"

namespace roslam::app {

namespace {
constexpr const char* kRealsense = "realsense";

DepthCameraMode mode_from(const std::string& text) {
  DepthCameraMode mode;
  if (text.empty()) return mode;
  int length = 0;
  const int found = std::sscanf(text.c_str(), "%5dx%5d@%4d%n", &mode.width, &mode.height, &mode.fps, &length);
  constexpr int kNumbers = 3;
  if (found != kNumbers || static_cast<std::size_t>(length) != text.size())
    throw InputError("--stream " + text + ": write WIDTHxHEIGHT@RATE, such as 640x480@30");
  return mode;
}

DepthCameraCalibration calibration_of(const FrameSource& source) {
  if (const auto* live = dynamic_cast<const LiveSource*>(&source)) return live->calibration();
  return {source.camera(), source.camera(), SE3()};
}

// The file, after an older one was renamed.
const std::string& kept(const std::string& file, const FrameSource& source) {
  if (source.is_live() && dynamic_cast<const LiveSource*>(&source) == nullptr)
    throw InputError(
        file + ": a camera whose images are made worse (--degrade) is not recorded; leave one of them out");
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error) || std::filesystem::file_size(file, error) == 0)
    return file;
  int number = 1;
  while (std::filesystem::exists(file + "." + std::to_string(number), error)) ++number;
  std::filesystem::rename(file, file + "." + std::to_string(number), error);
  if (error) throw OutputError(file + ": cannot be renamed to keep it; choose another name");
  return file;
}

const std::string& require_depth(const FrameSource& source, const std::string& file) {
  if (source.camera().is_stereo())
    throw InputError(file + ": stereo pairs cannot be recorded yet; record a source of colour and depth");
  return file;
}

CameraRecorderOptions options_of(const FrameSource& source) {
  CameraRecorderOptions options;
  options.waits_for_disk = !source.is_live();
  return options;
}
}  // namespace

bool is_live_camera(const std::string& name) {
  return name == kRealsense || name.starts_with(std::string(kRealsense) + ":");
}

std::unique_ptr<LiveSource> open_live_camera(const std::string& name, const std::string& stream,
                                             const std::string& mount) {
  LiveSourceOptions options;
  const std::size_t colon = name.find(':');
  if (colon != std::string::npos) options.serial = name.substr(colon + 1);
  options.mode = mode_from(stream);
  std::optional<SE3> T_body_camera;
  if (!mount.empty()) T_body_camera = mount_from(mount);
  return std::make_unique<LiveSource>(realsense_camera(), options, T_body_camera);
}

SourceRecorder::SourceRecorder(FrameSource& source, const std::string& file)
    : file_(require_depth(source, file)),
      live_(dynamic_cast<LiveSource*>(&source)),
      recorder_(kept(file, source), calibration_of(source), options_of(source)) {
  if (live_ != nullptr) live_->on_sample([this](const CameraSample& sample) { recorder_.add(sample); });
}

SourceRecorder::~SourceRecorder() {
  if (live_ != nullptr) live_->on_sample({});
}

void SourceRecorder::add(const Frame& frame, const std::stop_token& stop) {
  if (live_ == nullptr) recorder_.add(frame, stop);
}

std::string SourceRecorder::in_words() const {
  std::string words =
      "recorded: " + file_ + formatted(", %.1f MB", static_cast<double>(recorder_.bytes()) * 1e-6);
  if (const std::size_t lost = recorder_.lost(); lost > 0)
    words += "\nWARNING: " + std::to_string(lost) +
             " images or samples were not recorded, as the disk is too slow for them";
  return words;
}

}  // namespace roslam::app
