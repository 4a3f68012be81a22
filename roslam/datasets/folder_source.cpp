// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/folder_source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

FolderSource::FolderSource(FolderListing listing) : listing_(std::move(listing)) {
  const Camera& camera = listing_.camera;
  camera.validate();
  images_.skipped = listing_.skipped;
  images_.skipped_depth = listing_.skipped_depth;
  size_ = listing_.frames.size();
  for (const auto& [reason, number] : listing_.skipped) size_ += number;
  drop_frames_out_of_order();
  const auto& frames = listing_.frames;
  if (frames.empty()) throw InputError(listing_.folder + ": names no image; is the dataset complete?");
  has_depth_ = std::any_of(frames.begin(), frames.end(),
                           [](const ListedFrame& frame) { return !frame.depth.empty(); });
  if (has_depth_ && !(camera.depth_units_per_metre > 0.0)) {
    throw CalibrationError("camera calibration: depth_units_per_metre is not set; " +
                           std::string(usual_depth_units()));
  }
  if (listing_.colour_size.empty()) listing_.colour_size = {camera.width, camera.height};
  const auto& samples = listing_.inertial;
  constexpr double kBefore = 1.0;  // seconds before the first image
  while (next_inertial_ < samples.size() &&
         samples[next_inertial_].timestamp < frames.front().timestamp - kBefore)
    ++next_inertial_;
}

void FolderSource::drop_frames_out_of_order() {
  std::vector<ListedFrame> kept;
  kept.reserve(listing_.frames.size());
  for (ListedFrame& frame : listing_.frames) {
    const bool is_later = kept.empty() || frame.segment > kept.back().segment ||
                          (frame.segment == kept.back().segment && frame.timestamp > kept.back().timestamp);
    if (!std::isfinite(frame.timestamp)) {
      ++images_.skipped["colour image without a time"];
    } else if (!is_later) {
      ++images_.skipped["colour image with a time that is not later than that of the one before"];
    } else {
      if (frame.T_world_camera && !frame.T_world_camera->is_finite()) frame.T_world_camera.reset();
      kept.push_back(std::move(frame));
    }
  }
  listing_.frames = std::move(kept);
}

std::map<std::string, std::size_t> FolderSource::notes() const {
  auto notes = listing_.notes;
  images_.add_to(notes);
  return notes;
}

std::optional<Frame> FolderSource::next() {
  while (position_ < listing_.frames.size()) {
    if (auto frame = read(position_++)) return frame;
  }
  return std::nullopt;
}

std::optional<Frame> FolderSource::read(std::size_t index) {
  const ListedFrame& files = listing_.frames[index];
  Frame frame;
  frame.colour = images_.colour(files.colour, listing_.colour_size);
  if (frame.colour.empty()) return std::nullopt;
  frame.index = index;
  frame.segment = files.segment;
  frame.timestamp = files.timestamp;
  frame.depth = read_depth(files, frame.colour.size());
  if (listing_.transform) listing_.transform(frame.colour, frame.depth);
  frame.right = read_right(files);
  frame.T_world_camera = files.T_world_camera;
  const auto& samples = listing_.inertial;
  while (next_inertial_ < samples.size() && samples[next_inertial_].timestamp <= frame.timestamp)
    frame.inertial.push_back(samples[next_inertial_++]);
  return frame;
}

cv::Mat FolderSource::read_right(const ListedFrame& files) {
  if (!listing_.right) return {};
  if (files.right.empty()) {
    ++images_.skipped_depth["no right image near in time"];
    return {};
  }
  return images_.right(files.right, {listing_.right->camera.width, listing_.right->camera.height});
}

cv::Mat FolderSource::read_depth(const ListedFrame& files, const cv::Size& colour_size) {
  if (files.depth.empty()) {
    if (has_depth_) ++images_.skipped_depth["no depth image near in time"];
    return {};
  }
  const double units = listing_.camera.depth_units_per_metre;
  return listing_.depth_size.empty()
             ? images_.depth(files.depth, units, colour_size)
             : images_.depth(files.depth, units, listing_.depth_size, "the depth camera");
}

}  // namespace roslam
