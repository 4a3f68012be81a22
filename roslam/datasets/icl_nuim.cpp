// SPDX-License-Identifier: BSD-3-Clause
// ICL-NUIM, "TUM RGB-D compatible PNGs": rgb/N.png, depth/N.png (5000 a metre, along the optical axis),
// associations.txt ("N depth/N.png N rgb/N.png") and SCENE.gt.freiburg, a TUM trajectory whose times are N.
//
// Its renderer has a left-handed camera frame, x right, y up, z forward, in a left-handed world, y up. A
// point (X, Y, Z) of that frame is seen at u = 481.2 X / Z + 319.5, v = -480 Y / Z + 239.5, which is the
// published matrix with fy = -480. With D = diag(1, -1, 1), the point D (X, Y, Z) of the frame that RO-SLAM
// uses, x right, y down, z forward, is seen at the same pixel by a camera with fy = +480 and the same cy. So
// the images stay as they are, upright, which the networks need as well. A pose p_world = R p_camera + t
// becomes
//   D p_world = (D R D) D p_camera + D t,
// where D R D is a rotation again, as det D = -1 counts twice: the world is mirrored too, to a right-handed
// one whose y axis points down. To keep the poses and turn the rows of the images upside down instead (fy =
// +480, cy = 479 - 239.5) would be consistent as well, but SLAM would see a mirrored, upside-down room. To
// keep both is wrong: the truth would turn and climb the other way.
#include <algorithm>
#include <vector>

#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/paired_lists.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam::datasets {

namespace {
std::optional<Path> trajectory_file(const Path& folder) {
  std::vector<Path> found;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    if (entries->path().filename().string().ends_with(".gt.freiburg")) found.push_back(entries->path());
  }
  if (found.empty()) return std::nullopt;
  return *std::min_element(found.begin(), found.end());
}

// A rendered image has no distortion, and its depth no noise.
Camera icl_camera() {
  Camera camera;
  camera.fx = 481.2;
  camera.fy = 480.0;
  camera.cx = 319.5;
  camera.cy = 239.5;
  camera.depth_units_per_metre = 5000.0;
  return camera;
}

SE3 mirrored(const SE3& pose) {
  const Eigen::Vector3d D(1.0, -1.0, 1.0);
  const Eigen::Matrix3d R = D.asDiagonal() * pose.rotation().toRotationMatrix() * D.asDiagonal();
  return {R, D.cwiseProduct(pose.translation())};
}
}  // namespace

bool is_icl_nuim(const Path& folder) {
  return trajectory_file(folder).has_value() && find_paired_list(folder).has_value();
}

FolderListing list_icl_nuim(const Path& folder, const GivenCamera& camera) {
  FolderListing listing{folder.string(), camera.value_or(icl_camera()), {}};
  const double seconds = list_pairs(read_paired_list(find_paired_list(folder).value()), listing);
  const Trajectory truth = read_ground_truth(trajectory_file(folder).value(), seconds, listing.notes);
  std::size_t without = 0;
  for (auto& frame : listing.frames) {
    if (const auto pose = true_pose_at(truth, frame.timestamp)) frame.T_world_camera = mirrored(*pose);
    without += frame.T_world_camera ? 0 : 1;
  }
  count(listing.notes, "image without a valid pose; no truth there", without);
  ++listing.notes["the world of the ground truth was mirrored in y, as the renderer's is left-handed"];
  return listing;
}

}  // namespace roslam::datasets
