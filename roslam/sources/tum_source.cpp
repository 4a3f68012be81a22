// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sources/tum_source.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "roslam/error.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam {

namespace {
std::vector<TimedFile> read_list(const std::filesystem::path& list) {
  std::ifstream in(list);
  if (!in) {
    throw InputError(list.string() + ": cannot open it; a TUM RGB-D folder holds rgb.txt, depth.txt and the images "
                     "they name");
  }
  std::vector<TimedFile> entries;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") == std::string::npos || line[line.find_first_not_of(" \t")] == '#') continue;
    std::istringstream fields(line);
    TimedFile entry;
    std::string file;
    if (!(fields >> entry.timestamp >> file) || !std::isfinite(entry.timestamp)) {
      throw InputError(list.string() + ":" + std::to_string(number) + ": expected 'timestamp file', got '" + line +
                       "'");
    }
    entry.file = file;
    entries.push_back(entry);
  }
  if (entries.empty()) throw InputError(list.string() + ": names no image; is the dataset complete?");
  return entries;
}

// Drops entries that do not come later than the one before, and says how many.
std::size_t drop_out_of_order(std::vector<TimedFile>& entries) {
  const std::size_t before = entries.size();
  std::vector<TimedFile> kept;
  for (const auto& entry : entries) {
    if (kept.empty() || entry.timestamp > kept.back().timestamp) kept.push_back(entry);
  }
  entries = kept;
  return before - kept.size();
}
}  // namespace

void TumOptions::validate() const {
  if (!(max_time_difference >= 0.0 && max_time_difference < 10.0)) {
    throw OptionsError("max_time_difference must be 0 to 10 seconds, got " + std::to_string(max_time_difference));
  }
}

std::vector<int> associate(const std::vector<TimedFile>& colour, const std::vector<TimedFile>& depth,
                           double max_time_difference) {
  struct Pair {
    double difference;
    std::size_t colour;
    std::size_t depth;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    const auto first = std::lower_bound(depth.begin(), depth.end(), colour[i].timestamp - max_time_difference,
                                        [](const TimedFile& d, double time) { return d.timestamp < time; });
    for (auto it = first; it != depth.end() && it->timestamp <= colour[i].timestamp + max_time_difference; ++it) {
      pairs.push_back({std::abs(it->timestamp - colour[i].timestamp), i,
                       static_cast<std::size_t>(it - depth.begin())});
    }
  }
  // Closest pairs first, so that no image is taken by a neighbour it fits less well.
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.difference < b.difference; });
  std::vector<int> result(colour.size(), -1);
  std::vector<bool> used(depth.size(), false);
  for (const auto& pair : pairs) {
    if (result[pair.colour] >= 0 || used[pair.depth]) continue;
    result[pair.colour] = static_cast<int>(pair.depth);
    used[pair.depth] = true;
  }
  return result;
}

bool TumSource::recognises(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "rgb.txt");
}

TumSource::TumSource(const std::filesystem::path& folder, const Camera& camera, const TumOptions& options)
    : folder_(folder), camera_(camera) {
  options.validate();
  camera.validate();
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(folder.string() + ": no such folder; give a TUM RGB-D dataset or simulated:street");
  }
  colour_ = read_list(folder / "rgb.txt");
  depth_ = read_list(folder / "depth.txt");
  if (const auto dropped = drop_out_of_order(colour_)) skipped_["colour image out of the order of time"] = dropped;
  if (const auto dropped = drop_out_of_order(depth_)) skipped_["depth image out of the order of time"] = dropped;
  depth_of_colour_ = associate(colour_, depth_, options.max_time_difference);
}

std::optional<Frame> TumSource::next() {
  while (position_ < colour_.size()) {
    if (auto frame = read(position_++)) return frame;
  }
  return std::nullopt;
}

std::optional<Frame> TumSource::read(std::size_t index) {
  const ImageFile colour = read_colour_image(folder_ / colour_[index].file);
  if (!colour.error.empty()) {
    ++skipped_["colour image " + colour.error];
    return std::nullopt;
  }
  if (colour.image.size() != cv::Size(camera_.width, camera_.height)) {
    ++skipped_["colour image size differs from the camera's"];
    return std::nullopt;
  }
  Frame frame;
  frame.index = index;
  frame.timestamp = colour_[index].timestamp;
  frame.colour = colour.image;
  frame.depth = read_depth_for(index, colour.image.size());
  return frame;
}

cv::Mat TumSource::read_depth_for(std::size_t index, const cv::Size& colour_size) {
  if (depth_of_colour_[index] < 0) {
    ++skipped_["no depth image near in time"];
    return {};
  }
  const auto& entry = depth_[static_cast<std::size_t>(depth_of_colour_[index])];
  const ImageFile depth = read_depth_image(folder_ / entry.file);
  if (!depth.error.empty()) {
    ++skipped_["depth image " + depth.error];
    return {};
  }
  if (depth.image.size() != colour_size) {
    ++skipped_["depth image size differs from the colour image's"];
    return {};
  }
  return depth_to_metres(depth.image, camera_.depth_units_per_metre);
}

}  // namespace roslam
