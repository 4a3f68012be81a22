// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

struct BundleAdjustmentOptions {
  int iterations = 6;   ///< Levenberg-Marquardt steps at most
  int window = 10;      ///< keyframes that move in local bundle adjustment; others that see the same stay put
  int min_shared = 15;  ///< landmarks a keyframe must share with the newest one to move with it

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A bundle adjustment problem, cut loose from the map: indices refer to the vectors in here.
struct BundleProblem {
  struct Pose {
    SE3 T_camera_world;
    bool is_fixed = false;
  };
  struct Term {
    std::size_t pose = 0;
    std::size_t point = 0;
    Measurement measurement;
  };
  std::vector<Pose> poses;
  std::vector<Eigen::Vector3d> points;  ///< world frame, metres
  std::vector<Term> terms;
};

struct BundleSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  bool is_usable = false;  ///< false if the solver failed; the problem is unchanged then
};

/// Moves poses and points so that the sum of robust (Huber) squared errors of all terms becomes least. Solved
/// by Ceres with analytic derivatives and the sparse Schur complement, on one thread, so that results repeat
/// bit by bit. should_stop is asked after each step.
BundleSummary adjust_bundle(const Camera& camera, BundleProblem& problem,
                            const BundleAdjustmentOptions& options,
                            const std::function<bool()>& should_stop = {});

/// Terms whose squared error is within the chi-squared limit and whose point lies in front of the camera.
std::vector<bool> bundle_inliers(const Camera& camera, const BundleProblem& problem);

}  // namespace roslam
