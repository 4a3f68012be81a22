// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/numbered_poses.hpp"

#include "roslam/datasets/text_numbers.hpp"

namespace roslam::datasets {

void list_numbered(const std::map<long, std::filesystem::path>& colour,
                   const std::map<long, std::filesystem::path>& depth,
                   const std::map<long, std::filesystem::path>& poses, double fps, FolderListing& listing) {
  for (const auto& [number, file] : colour) {
    ListedFrame frame;
    frame.timestamp = static_cast<double>(number) / fps;
    frame.colour = file;
    if (const auto found = depth.find(number); found != depth.end()) frame.depth = found->second;
    if (const auto found = poses.find(number); found != poses.end()) {
      const auto matrix = read_matrix(found->second);
      if (matrix) frame.T_world_camera = rigid_transform(*matrix);
    }
    if (!frame.T_world_camera && !poses.empty())
      ++listing.notes["image without a valid pose; no truth there"];
    listing.frames.push_back(std::move(frame));
  }
  std::size_t alone = 0;
  for (const auto& [number, file] : depth) alone += colour.contains(number) ? 0 : 1;
  count(listing.skipped_depth, "depth image without a colour image", alone);
}

}  // namespace roslam::datasets
