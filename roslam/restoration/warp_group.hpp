// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/fours.hpp"
#include "roslam/restoration/source_warp.hpp"

namespace roslam {

/// The warps of a target, evaluated together for a point: what SourceWarp computes for each, several times
/// faster. Not thread-safe.
class WarpGroup {
 public:
  /// rays and warps must outlive the group.
  WarpGroup(const PixelRays& rays, const std::vector<SourceWarp>& warps);

  /// SourceWarp::project() of each warp. A source that the point lies outside of shows nothing.
  const std::vector<WarpedPoint>& project(const Eigen::Vector3f& point);

  /// What project() returned last.
  const std::vector<WarpedPoint>& warped() const { return warped_; }

  /// SourceWarp::weight() of each warp, to 1e-5, for the point projected last; those of sources that the
  /// point lies behind have no meaning.
  const std::vector<Four>& weights();

  /// weights(), or those computed last if the point is near that of those: weights change slowly.
  const std::vector<Four>& weights_nearby();

 private:
  struct Warps {
    Four rotation[3][3], translation[3];  // source from target
    Four centre[3];                       // of the source camera
    Four age_weight;
  };

  const PixelRays& rays_;
  const std::vector<SourceWarp>& all_;
  std::vector<Warps> fours_;
  float angle_scale_ = 1.0F;  // radians
  Eigen::Vector3f point_ = Eigen::Vector3f::Zero();
  std::vector<Four> x_, y_;  // the point in each source camera's frame, metres, then its pixel
  std::vector<Four> depth_;  // z, metres
  std::vector<WarpedPoint> warped_;
  std::vector<Four> weights_;
  Eigen::Vector3f weighted_ = Eigen::Vector3f::Zero();  // the point of the weights
};

}  // namespace roslam
