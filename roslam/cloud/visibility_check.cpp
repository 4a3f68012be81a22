// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/visibility_check.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/geometry/motion.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 0.1F;     // metres before the camera
constexpr float kDeviations = 2.0F;  // of depth noise that two depths of one surface may differ by
constexpr float kFlattest = 0.2F;    // cosine to the normal that a voxel is taken to be seen at, at least
constexpr float kThroughAtMost =
    0.25F;  // weight of views that look through a point to that of those that see it
}  // namespace

VisibilityCheck::VisibilityCheck(const Surface& surface, double voxel_size, const MeasurementNoise& noise)
    : surface_(surface),
      voxel_size_(static_cast<float>(voxel_size)),
      noise_(noise),
      votes_(surface.points.size()),
      invented_(surface.points.size()) {}

void VisibilityCheck::ask(const DenseView& view, const SE3& T_world_camera) {
  const Motion camera_from_world(T_world_camera.inverse());
  const auto fx = static_cast<float>(view.camera.fx), fy = static_cast<float>(view.camera.fy);
  const auto cx = static_cast<float>(view.camera.cx) + 0.5F, cy = static_cast<float>(view.camera.cy) + 0.5F;
  const auto columns = static_cast<float>(view.depth.cols), rows = static_cast<float>(view.depth.rows);
  for (std::size_t i = 0; i < surface_.points.size(); ++i) {
    const SurfacePoint& point = surface_.points[i];
    const Eigen::Vector3f at = camera_from_world * point.position;
    if (at.z() < kNearest) continue;
    const float u = at.x() / at.z() * fx + cx, v = at.y() / at.z() * fy + cy;
    if (!(u >= 0.0F && v >= 0.0F && u < columns && v < rows)) continue;
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    const bool is_beyond = !view.beyond.empty() && view.beyond.at<std::uint8_t>(row, column) != 0;
    const float depth = is_beyond ? static_cast<float>(view.reach) : view.depth.at<float>(row, column);
    const bool is_invented =
        view.provenance.at<std::uint8_t>(row, column) == static_cast<std::uint8_t>(Provenance::kInvented);
    // What was invented says nothing against what was seen, but something against other inventions.
    if (depth == 0.0F || (is_invented && point.provenance != Provenance::kInvented)) continue;
    Votes& votes = is_invented ? invented_[i] : votes_[i];
    const float cosine = std::abs((camera_from_world.rotation * point.normal).dot(at)) / at.norm();
    const auto sigma = static_cast<float>(noise_.sigma_of_depth(static_cast<double>(depth)));
    const float tolerance = kDeviations * sigma + voxel_size_ / std::max(cosine, kFlattest);
    if (depth - at.z() > tolerance) {
      votes.through += 1.0F / sigma;
    } else if (!is_beyond && depth - at.z() > -tolerance) {
      votes.seen += 1.0F / sigma;
    }
  }
}

std::vector<bool> VisibilityCheck::confirmed() const {
  const auto agree = [](const Votes& votes) { return votes.through <= kThroughAtMost * votes.seen; };
  std::vector<bool> result(votes_.size());
  for (std::size_t i = 0; i < votes_.size(); ++i) result[i] = agree(votes_[i]) && agree(invented_[i]);
  return result;
}

}  // namespace roslam
