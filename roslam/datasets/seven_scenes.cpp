// SPDX-License-Identifier: BSD-3-Clause
// 7-Scenes: frame-XXXXXX.color.png, .depth.png (millimetres; 0 and 65535 unknown), .pose.txt (4x4, camera to
// world). Frames have no times; the Kinect takes 30 a second.
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/numbered_poses.hpp"
#include "roslam/datasets/text_numbers.hpp"

namespace roslam::datasets {

namespace {
std::map<long, Path> colour_files(const Path& folder) {
  return numbered_files(folder, "frame-", {".color.png", ".color.jpg"});
}
}  // namespace

bool is_seven_scenes(const Path& folder) { return !colour_files(folder).empty(); }

FolderListing list_seven_scenes(const Path& folder, const GivenCamera& camera) {
  FolderListing listing{folder.string(), camera.value_or(*camera_preset("7scenes")), {}};
  list_numbered(colour_files(folder), numbered_files(folder, "frame-", {".depth.png"}),
                numbered_files(folder, "frame-", {".pose.txt"}), listing.camera.fps, listing);
  ++listing.notes["the depth of 7-Scenes as published is not registered to colour, and is used as it is"];
  return listing;
}

}  // namespace roslam::datasets
