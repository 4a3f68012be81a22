// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/map_sequence.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;
constexpr double kLongestGap = 0.2;  // seconds; longest interval of true poses to interpolate in

bool is_file(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

Camera camera_of(const MapSequenceSettings& settings) {
  if (!settings.camera.empty()) return load_camera(settings.camera);
  const fs::path file = settings.sequence / "camera.yaml";
  if (is_file(file)) return read_camera(file);
  throw InputError(file.string() + ": is missing; give --camera with a preset or a file");
}

const fs::path& background_folder(const MapSequenceSettings& settings) {
  if (!settings.background.empty()) return settings.background;
  if (knows_background(settings.sequence)) return settings.sequence;
  throw InputError(
      settings.sequence.string() +
      ": has no images of the static background; give a folder of roslam simulate or compose, or with "
      "--background the same images without dynamic objects");
}

double units_of(const MapSequenceSettings& settings, const fs::path& folder) {
  const auto units =
      settings.background_depth_units ? settings.background_depth_units : depth_units_beside(folder);
  if (units) return *units;
  throw InputError(folder.string() +
                   ": the depth units of its background are not stated; give --truth-depth-units");
}

std::map<std::string, SequenceImage> by_time(std::vector<SequenceImage> images) {
  std::map<std::string, SequenceImage> result;
  for (auto& image : images) {
    if (image.timestamp) result[time_text(*image.timestamp)] = std::move(image);
  }
  return result;
}

cv::Mat depth_in(const fs::path& file, double units) {
  if (file.empty()) return {};
  const cv::Mat raw = read_depth_image(file).image;
  return raw.empty() ? raw : depth_to_metres(raw, units);
}
}  // namespace

MapSequence::MapSequence(const MapSequenceSettings& settings)
    : trajectory_(read_trajectory(settings.sequence / "groundtruth.txt").trajectory),
      camera_(camera_of(settings)) {
  const fs::path& background = background_folder(settings);
  backgrounds_ = background_of(background);
  std::erase_if(backgrounds_, [](const auto& image) { return !image.timestamp || image.depth.empty(); });
  if (backgrounds_.empty()) {
    throw InputError(background.string() +
                     ": has no depth images of the background with timestamps; a map cannot be compared "
                     "with colour alone");
  }
  background_units_ = units_of(settings, background);
  images_ = by_time(images_of(settings.sequence));
  moving_ = MovingTruthFolder::open(settings.sequence);
  // Another folder with a background is the same flight rendered with better depth: use its images too.
  const bool has_both = !settings.background.empty() && knows_background(background);
  taken_ = has_both ? by_time(images_of(background)) : images_;
  taken_units_ = has_both && is_file(background / "camera.yaml")
                     ? read_camera(background / "camera.yaml").depth_units_per_metre
                     : camera_.depth_units_per_metre;
}

std::optional<MapTruthFrame> MapSequence::frame(std::size_t index) const {
  const SequenceImage& background = backgrounds_.at(index);
  const auto pose = pose_at(trajectory_, *background.timestamp, kLongestGap);
  if (!pose) return std::nullopt;
  MapTruthFrame frame;
  frame.T_world_camera = pose->T_world_camera;
  frame.background_depth = depth_in(background.depth, background_units_);
  if (frame.background_depth.empty()) return std::nullopt;
  frame.background_colour = read_colour_image(background.colour).image;
  add_taken(frame, time_text(*background.timestamp));
  return frame;
}

// Depth whose masks cannot be read is not used: static surfaces would count as moving.
void MapSequence::add_taken(MapTruthFrame& frame, const std::string& time) const {
  const auto taken = taken_.find(time);
  if (taken == taken_.end()) return;
  if (moving_) {
    const auto image = images_.find(time);
    if (image == images_.end()) return;
    frame.moving = moving_->read(image->second.name);
    if (!frame.moving) return;
  }
  frame.taken_depth = depth_in(taken->second.depth, taken_units_);
}

}  // namespace roslam::app
