// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/dense/surface_map.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Finds surface points that other keyframes observe as free space: a dynamic object missed by the detection
/// is fused from some keyframes, but others observe what is behind it. The TSDF alone is carved by later
/// keyframes only; this check uses all.
class VisibilityCheck {
 public:
  /// voxel_size: metres, of the volume of the surface. The surface must outlive the check.
  VisibilityCheck(const SurfaceMap& surface, double voxel_size, const MeasurementNoise& noise);

  /// Adds a keyframe's observations of the surface points. Its inpainted pixels vote only on inpainted
  /// points, so that of contradicting inpaintings the minority is removed.
  void ask(const DepthKeyframe& keyframe, const SE3& T_world_camera);

  /// For each point, whether the weight of the keyframes that see through it is small against that of those
  /// that see it. Weights are inverse depth noise.
  std::vector<bool> confirmed() const;

 private:
  const SurfaceMap& surface_;
  float voxel_size_;
  MeasurementNoise noise_;
  // Sums of the weights of keyframes that see a point and of those that see through it.
  struct Votes {
    float seen = 0.0F, through = 0.0F;
  };
  std::vector<Votes> votes_;            // one for each point, of measured and reprojected pixels
  std::vector<Votes> inpainted_votes_;  // of inpainted pixels, for inpainted points
};

}  // namespace roslam
