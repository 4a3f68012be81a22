// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A similarity: x -> scale R x + t. With scale 1 a rigid motion.
struct Alignment {
  double scale = 1.0;
  SE3 T_target_source;          ///< R and t; t in the target's units
  bool unique_rotation = true;  ///< false where the points lie on one line or in one spot: R is one of many

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
/// Points on one line or in one spot are aligned too, though not uniquely (a drone may fly straight or
/// hover). None where there is no answer: fewer than three points, counts that differ, values that are not
/// finite, or a scale asked of source points that all coincide.
std::optional<Alignment> align(const std::vector<Eigen::Vector3d>& source,
                               const std::vector<Eigen::Vector3d>& target, AlignmentModel model);

/// The motion T_target_source that takes poses of a body in one world to the poses of the same index in
/// another: its rotation is the mean of target times inverse source (Markley, Cheng, Crassidis, Oshman:
/// "Averaging Quaternions", JGCD 2007), its translation the mean of what is left. Unlike align it is unique
/// on a straight path and at rest too, but trusts that no pose is turned by much. None for no poses, counts
/// that differ, and values that are not finite.
std::optional<SE3> align_poses(const std::vector<SE3>& source, const std::vector<SE3>& target);

}  // namespace roslam
