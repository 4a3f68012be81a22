// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/restoration_pictures.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "roslam/geometry/camera.hpp"
#include "roslam/sources/picture_source.hpp"
#include "roslam/sources/tum_source.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

bool is_file(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

bool has_background_folder(const fs::path& folder) {
  std::error_code error;
  return is_file(folder / "rgb.txt") && fs::is_directory(folder / "background" / "rgb", error);
}

std::vector<TimedFile> sorted_list(const fs::path& file) {
  auto list = read_tum_list(file);
  std::stable_sort(list.begin(), list.end(),
                   [](const TimedFile& a, const TimedFile& b) { return a.timestamp < b.timestamp; });
  return list;
}

// folder: that the files in the lists are relative to.
std::vector<SequencePicture> listed(const fs::path& folder, const fs::path& colour_list,
                                    const fs::path& depth_list) {
  const auto colour = sorted_list(colour_list);
  const auto depth = is_file(depth_list) ? sorted_list(depth_list) : std::vector<TimedFile>{};
  const auto depth_of = associate(colour, depth, TumOptions{}.max_time_difference);
  std::vector<SequencePicture> pictures;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    SequencePicture picture{colour[i].file.stem().string(), colour[i].timestamp, folder / colour[i].file, {}};
    if (depth_of[i] >= 0) picture.depth = folder / depth[static_cast<std::size_t>(depth_of[i])].file;
    pictures.push_back(std::move(picture));
  }
  return pictures;
}
}  // namespace

std::vector<SequencePicture> pictures_of(const fs::path& folder) {
  if (is_file(folder / "rgb.txt")) return listed(folder, folder / "rgb.txt", folder / "depth.txt");
  std::vector<SequencePicture> pictures;
  for (const auto& file : pictures_in(folder))
    pictures.push_back({file.stem().string(), std::nullopt, file, {}});
  return pictures;
}

bool knows_background(const fs::path& folder) {
  return is_file(folder / "background.txt") || has_background_folder(folder);
}

std::vector<SequencePicture> background_of(const fs::path& folder) {
  if (is_file(folder / "background.txt"))
    return listed(folder, folder / "background.txt", folder / "background_depth.txt");
  if (has_background_folder(folder))
    return listed(folder / "background", folder / "rgb.txt", folder / "depth.txt");
  return pictures_of(folder);
}

std::optional<double> depth_units_beside(const fs::path& folder) {
  // What people were composed into has units of its own.
  if (is_file(folder / "background.txt")) {
    const auto json = nlohmann::json::parse(std::ifstream(folder / "composition.json"), nullptr, false);
    const char* key = "background_depth_units_per_metre";
    if (!json.is_object() || !json.contains(key) || !json[key].is_number()) return std::nullopt;
    return json[key].get<double>();
  }
  if (!is_file(folder / "camera.yaml")) return std::nullopt;
  return read_camera(folder / "camera.yaml").depth_units_per_metre;
}

}  // namespace roslam::app
