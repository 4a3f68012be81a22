// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/visibility_check.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/geometry/se3f.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 0.1F;     // metres in front of the camera
constexpr float kDeviations = 2.0F;  // standard deviations by which two depths of one surface may differ
constexpr float kFlattest = 0.2F;    // lower limit of the cosine between ray and normal
constexpr float kMaxThroughRatio = 0.25F;  // weight of `through` votes to `seen` ones
}  // namespace

VisibilityCheck::VisibilityCheck(const SurfaceMap& surface, double voxel_size, const MeasurementNoise& noise)
    : surface_(surface),
      voxel_size_(static_cast<float>(voxel_size)),
      noise_(noise),
      votes_(surface.points.size()),
      inpainted_votes_(surface.points.size()) {}

void VisibilityCheck::ask(const DepthKeyframe& keyframe, const SE3& T_world_camera) {
  const SE3f camera_from_world(T_world_camera.inverse());
  const DepthNoise noise = keyframe.noise.value_or(noise_.depth_noise());
  const auto fx = static_cast<float>(keyframe.camera.fx), fy = static_cast<float>(keyframe.camera.fy);
  const auto cx = static_cast<float>(keyframe.camera.cx) + 0.5F,
             cy = static_cast<float>(keyframe.camera.cy) + 0.5F;
  const auto columns = static_cast<float>(keyframe.depth.cols),
             rows = static_cast<float>(keyframe.depth.rows);
  for (std::size_t i = 0; i < surface_.points.size(); ++i) {
    const SurfacePoint& point = surface_.points[i];
    const Eigen::Vector3f at = camera_from_world * point.position;
    if (at.z() < kNearest) continue;
    const float u = at.x() / at.z() * fx + cx, v = at.y() / at.z() * fy + cy;
    if (!(u >= 0.0F && v >= 0.0F && u < columns && v < rows)) continue;
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    const bool is_beyond = !keyframe.beyond.empty() && keyframe.beyond.at<std::uint8_t>(row, column) != 0;
    const float depth =
        is_beyond ? static_cast<float>(keyframe.reach) : keyframe.depth.at<float>(row, column);
    const bool is_inpainted = keyframe.provenance.at<std::uint8_t>(row, column) ==
                              static_cast<std::uint8_t>(Provenance::kInpainted);
    // Inpainted pixels contradict only other inpainted surfaces.
    if (depth == 0.0F || (is_inpainted && point.provenance != Provenance::kInpainted)) continue;
    Votes& votes = is_inpainted ? inpainted_votes_[i] : votes_[i];
    const float cosine = std::abs((camera_from_world.rotation * point.normal).dot(at)) / at.norm();
    const auto sigma = static_cast<float>(noise.sigma(static_cast<double>(depth)));
    const float tolerance = kDeviations * sigma + voxel_size_ / std::max(cosine, kFlattest);
    if (depth - at.z() > tolerance) {
      votes.through += 1.0F / sigma;
    } else if (!is_beyond && depth - at.z() > -tolerance) {
      votes.seen += 1.0F / sigma;
    }
  }
}

std::vector<bool> VisibilityCheck::confirmed() const {
  const auto is_confirmed = [](const Votes& votes) { return votes.through <= kMaxThroughRatio * votes.seen; };
  std::vector<bool> result(votes_.size());
  for (std::size_t i = 0; i < votes_.size(); ++i)
    result[i] = is_confirmed(votes_[i]) && is_confirmed(inpainted_votes_[i]);
  return result;
}

}  // namespace roslam
