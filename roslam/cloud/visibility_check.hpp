// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/cloud/dense_view.hpp"
#include "roslam/cloud/surface.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Finds the points of a surface that views look through: what moves and slipped through the removal was
/// fused from some views, but others, before it came or after it left, see what is behind. Voxels are carved
/// by views that come after; this asks all.
class VisibilityCheck {
 public:
  /// voxel_size: metres, of the map that the surface is of. The surface must outlive the check.
  VisibilityCheck(const Surface& surface, double voxel_size, const MeasurementNoise& noise);

  /// Lets a view say what it sees of the surface. What was invented in it has a say only about what was
  /// invented in others: where inventions differ, those of few views go.
  void ask(const DenseView& view, const SE3& T_world_camera);

  /// For each point, whether enough of those that should see it do. Views weigh by the noise of their
  /// readings.
  std::vector<bool> confirmed() const;

 private:
  const Surface& surface_;
  float voxel_size_;
  MeasurementNoise noise_;
  // Sums of the weights of views that see a point and of those that look through it.
  struct Votes {
    float seen = 0.0F, through = 0.0F;
  };
  std::vector<Votes> votes_;     // one a point, of what was seen
  std::vector<Votes> invented_;  // of what was invented, about points that were
};

}  // namespace roslam
