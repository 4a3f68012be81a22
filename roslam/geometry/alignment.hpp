// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A similarity: x -> scale R x + t. With scale 1 a rigid transform.
struct ROSLAM_EXPORT Alignment {
  double scale = 1.0;
  SE3 T_target_source;          ///< R and t; t in the target's units
  bool unique_rotation = true;  ///< false if the points are collinear or coincide: R is one of many

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (T_target_source.rotation() * point) + T_target_source.translation();
  }
};

enum class AlignmentModel {
  kRigid,       ///< SE(3): stereo, RGB-D, anything with metric scale
  kSimilarity,  ///< Sim(3): monocular, whose scale is not observable
};

/// The least-squares alignment of source points to target points of the same index, in closed form: Umeyama,
/// "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
/// Collinear or coinciding points are aligned too, though not uniquely (a drone may fly straight or hover).
/// Nothing for fewer than three points, different counts, values that are not finite, or kSimilarity with
/// source points that coincide.
ROSLAM_EXPORT std::optional<Alignment> align_points(const std::vector<Eigen::Vector3d>& source,
                                             const std::vector<Eigen::Vector3d>& target,
                                             AlignmentModel model);

/// T_target_source that aligns poses T_source_body to the poses T_target_body of the same index: its rotation
/// is the mean of target times inverse source (Markley, Cheng, Crassidis, Oshman: "Averaging Quaternions",
/// JGCD 2007), its translation the mean of the remaining offsets. Unlike align it is unique on a straight
/// path and at rest too, but a few poses with a wrong orientation bias it. Nothing for no poses, different
/// counts, and values that are not finite.
ROSLAM_EXPORT std::optional<SE3> align_poses(const std::vector<SE3>& source, const std::vector<SE3>& target);

}  // namespace roslam
