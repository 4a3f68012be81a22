// SPDX-License-Identifier: BSD-3-Clause
// Folders in the layout of TUM RGB-D whose images are paired by a list of four columns.
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/paired_lists.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam::datasets {

bool is_associated(const Path& folder) { return find_paired_list(folder).has_value(); }

FolderListing list_associated(const Path& folder, const Camera& camera) {
  FolderListing listing{folder.string(), camera, {}};
  const double seconds = list_pairs(read_paired_list(find_paired_list(folder).value()), listing);
  const Path truth_file = folder / "groundtruth.txt";
  if (is_present(truth_file)) {
    const Trajectory truth = read_ground_truth(truth_file, seconds, listing.notes);
    for (auto& frame : listing.frames) {
      if (frame.segment == 0) frame.T_world_camera = true_pose_at(truth, frame.timestamp);
    }
  }
  if (is_present(folder / "imu.txt"))
    ++listing.notes["imu.txt is not used with a list of pairs; write rgb.txt and depth.txt"];
  return listing;
}

}  // namespace roslam::datasets
