// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/map_sequence.hpp"

#include <algorithm>

#include "roslam/error.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;
constexpr double kLongestGap = 0.2;  // seconds between true poses that are joined by interpolation

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
      ": does not know what it looks like without what moves; give a folder that roslam simulate "
      "or compose wrote, or with --background the same pictures without it");
}

double units_of(const MapSequenceSettings& settings, const fs::path& folder) {
  const auto units =
      settings.background_depth_units ? settings.background_depth_units : depth_units_beside(folder);
  if (units) return *units;
  throw InputError(folder.string() +
                   ": nothing tells the units of its background's depth; give --truth-depth-units");
}

std::map<std::string, SequencePicture> by_time(std::vector<SequencePicture> pictures) {
  std::map<std::string, SequencePicture> result;
  for (auto& picture : pictures) {
    if (picture.timestamp) result[time_text(*picture.timestamp)] = std::move(picture);
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
  std::erase_if(backgrounds_,
                [](const auto& picture) { return !picture.timestamp || picture.depth.empty(); });
  if (backgrounds_.empty()) {
    throw InputError(background.string() +
                     ": has no depth images of the background with a time; a map cannot be compared with "
                     "colour alone");
  }
  background_units_ = units_of(settings, background);
  pictures_ = by_time(pictures_of(settings.sequence));
  moving_ = MovingTruthFolder::open(settings.sequence);
  // Another folder with a background is the same flight, taken as truth because its depth is better.
  const bool has_both = !settings.background.empty() && knows_background(background);
  taken_ = has_both ? by_time(pictures_of(background)) : pictures_;
  taken_units_ = has_both && is_file(background / "camera.yaml")
                     ? read_camera(background / "camera.yaml").depth_units_per_metre
                     : camera_.depth_units_per_metre;
}

std::optional<MapTruthFrame> MapSequence::frame(std::size_t index) const {
  const SequencePicture& background = backgrounds_.at(index);
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

// Depth whose masks cannot be read is not used: what rests would be taken to move.
void MapSequence::add_taken(MapTruthFrame& frame, const std::string& time) const {
  const auto taken = taken_.find(time);
  if (taken == taken_.end()) return;
  if (moving_) {
    const auto picture = pictures_.find(time);
    if (picture == pictures_.end()) return;
    frame.moving = moving_->read(picture->second.name);
    if (!frame.moving) return;
  }
  frame.taken_depth = depth_in(taken->second.depth, taken_units_);
}

}  // namespace roslam::app
