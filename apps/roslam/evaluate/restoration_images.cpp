// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/restoration_images.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/roslam/support/image_source.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera.hpp"

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

// folder: the files in the lists are relative to it.
std::vector<SequenceImage> listed(const fs::path& folder, const fs::path& colour_list,
                                  const fs::path& depth_list) {
  const auto colour = sorted_list(colour_list);
  const auto depth = is_file(depth_list) ? sorted_list(depth_list) : std::vector<TimedFile>{};
  const auto depth_of = associate_by_time(colour, depth, TumOptions{}.max_time_difference);
  std::vector<SequenceImage> images;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    SequenceImage image{colour[i].file.stem().string(), colour[i].timestamp, folder / colour[i].file, {}};
    if (depth_of[i] >= 0) image.depth = folder / depth[static_cast<std::size_t>(depth_of[i])].file;
    images.push_back(std::move(image));
  }
  return images;
}
}  // namespace

std::vector<SequenceImage> images_of(const fs::path& folder) {
  if (is_file(folder / "rgb.txt")) return listed(folder, folder / "rgb.txt", folder / "depth.txt");
  std::vector<SequenceImage> images;
  for (const auto& file : images_in(folder)) images.push_back({file.stem().string(), std::nullopt, file, {}});
  return images;
}

bool knows_background(const fs::path& folder) {
  return is_file(folder / "background.txt") || has_background_folder(folder);
}

std::vector<SequenceImage> background_of(const fs::path& folder) {
  if (is_file(folder / "background.txt"))
    return listed(folder, folder / "background.txt", folder / "background_depth.txt");
  if (has_background_folder(folder))
    return listed(folder / "background", folder / "rgb.txt", folder / "depth.txt");
  return images_of(folder);
}

std::optional<double> depth_units_beside(const fs::path& folder) {
  // The recording that a sequence was composed from has depth units of its own.
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
