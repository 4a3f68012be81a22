// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/tum_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam {

namespace {
std::string in_words(double fps) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", fps);
  return text;
}
}  // namespace

void TumOptions::validate() const {
  if (!(max_time_difference >= 0.0 && max_time_difference < 10.0)) {
    throw OptionsError("max_time_difference must be 0 to 10 seconds, got " +
                       std::to_string(max_time_difference));
  }
}

std::vector<TimedFile> read_tum_list(const std::filesystem::path& file) {
  return read_timed_files(file).entries;
}

std::vector<int> associate_by_time(const std::vector<TimedFile>& colour, const std::vector<TimedFile>& depth,
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
    for (auto it = first; it != depth.end() && it->timestamp <= colour[i].timestamp + max_time_difference;
         ++it) {
      pairs.push_back(
          {std::abs(it->timestamp - colour[i].timestamp), i, static_cast<std::size_t>(it - depth.begin())});
    }
  }
  // Closest pairs first, so that each image is paired with its best partner.
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

std::optional<std::filesystem::path> TumSource::depth_file(std::size_t index) const {
  if (depth_of_colour_[index] < 0) return std::nullopt;
  return folder_ / depth_[static_cast<std::size_t>(depth_of_colour_[index])].file;
}

bool TumSource::recognises(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "rgb.txt");
}

TumSource::TumSource(const std::filesystem::path& folder, const Camera& camera, const TumOptions& options)
    : folder_(folder), camera_(camera), options_(options) {
  options.validate();
  camera.validate();
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(folder.string() + ": no such folder; give a TUM RGB-D dataset or simulated:street");
  }
  if (!(camera.depth_units_per_metre > 0.0)) {
    throw CalibrationError("camera calibration: depth_units_per_metre is not set; " +
                           std::string(usual_depth_units()) +
                           "; roslam camera convert --depth-units adds it to a camera file");
  }
  open_lists();
  pair_with_depth();
}

void TumSource::open_lists() {
  TimedFileList colour = read_timed_files(folder_ / "rgb.txt");
  TimedFileList depth = read_timed_files(folder_ / "depth.txt");
  size_ = colour.entries.size() + colour.without_time;
  const double seconds = convert_to_seconds({&colour, &depth}, camera_.fps, notes_).seconds;
  colour_ = ordered_entries("rgb.txt", "colour image", std::move(colour), notes_, images_.skipped);
  depth_ = ordered_entries("depth.txt", "depth image", std::move(depth), notes_, images_.skipped_depth);
  open_inertial(seconds);
  open_ground_truth(seconds);
  const double interval = median_interval(colour_);
  constexpr double kContradiction = 1.5;
  const double fps = interval > 0.0 ? 1.0 / interval : camera_.fps;
  if (fps < camera_.fps * kContradiction && fps > camera_.fps / kContradiction) return;
  ++notes_["the camera has " + in_words(camera_.fps) + " images a second, the timestamps " + in_words(fps)];
}

// seconds: the unit of the times.
void TumSource::open_inertial(double seconds) {
  const auto file = folder_ / "imu.txt";
  if (!std::filesystem::exists(file)) return;
  if (!camera_.imu) {
    ++notes_["imu.txt is not used, as the camera file has no imu"];
    return;
  }
  if (colour_.back().segment > 0) {
    ++notes_["imu.txt is not used, as the clock restarts"];
    return;
  }
  InertialFile inertial = read_inertial_file(file);
  count(notes_, "line of imu.txt that is no sample, skipped", inertial.skipped);
  constexpr double kBefore = 1.0;  // seconds before the first image
  for (InertialSample& sample : inertial.samples) {
    sample.timestamp *= seconds;
    if (sample.timestamp >= colour_.front().timestamp - kBefore) inertial_.push_back(sample);
  }
  if (inertial_.empty() || inertial_.front().timestamp > colour_.back().timestamp)
    ++notes_["imu.txt has no sample in the time of the images; its times must be of their clock and unit"];
}

void TumSource::open_ground_truth(double seconds) {
  const auto file = folder_ / "groundtruth.txt";
  if (!options_.ground_truth || !std::filesystem::exists(file)) return;
  if (colour_.back().segment > 0) {
    ++notes_["groundtruth.txt is not used, as the clock restarts"];
    return;
  }
  truth_ = read_ground_truth(file, seconds, notes_);
}

// The samples up to the time of a frame.
void TumSource::take_inertial(Frame& frame) {
  while (next_inertial_ < inertial_.size() && inertial_[next_inertial_].timestamp <= frame.timestamp)
    frame.inertial.push_back(inertial_[next_inertial_++]);
}

void TumSource::pair_with_depth() {
  const auto segments = [](const std::vector<TimedFile>& files) { return files.back().segment + 1; };
  if (segments(colour_) != segments(depth_)) {
    throw InputError(folder_.string() + ": the clock restarts " + std::to_string(segments(colour_) - 1) +
                     " times in rgb.txt and " + std::to_string(segments(depth_) - 1) +
                     " times in depth.txt; split the recording where it restarts");
  }
  for (int segment = 0; segment < segments(colour_); ++segment) {
    const auto part = [segment](const std::vector<TimedFile>& files) {
      const auto [begin, end] =
          std::equal_range(files.begin(), files.end(), TimedFile{0.0, {}, segment},
                           [](const TimedFile& a, const TimedFile& b) { return a.segment < b.segment; });
      return std::pair(static_cast<int>(begin - files.begin()), std::vector<TimedFile>(begin, end));
    };
    const auto [first_depth, depth] = part(depth_);
    for (const int index : associate_by_time(part(colour_).second, depth, options_.max_time_difference))
      depth_of_colour_.push_back(index < 0 ? -1 : first_depth + index);
  }
}

std::map<std::string, std::size_t> TumSource::notes() const {
  auto notes = notes_;
  images_.add_to(notes);
  return notes;
}

std::optional<Frame> TumSource::next() {
  while (position_ < colour_.size()) {
    if (auto frame = read(position_++)) return frame;
  }
  return std::nullopt;
}

std::optional<Frame> TumSource::read(std::size_t index) {
  Frame frame;
  frame.colour = images_.colour(folder_ / colour_[index].file, {camera_.width, camera_.height});
  if (frame.colour.empty()) return std::nullopt;
  frame.index = index;
  frame.segment = colour_[index].segment;
  frame.timestamp = colour_[index].timestamp;
  if (const auto file = depth_file(index)) {
    frame.depth = images_.depth(*file, camera_.depth_units_per_metre, frame.colour.size());
  } else {
    ++images_.skipped_depth["no depth image near in time"];
  }
  frame.T_world_camera = true_pose_at(truth_, frame.timestamp);
  take_inertial(frame);
  return frame;
}

}  // namespace roslam
