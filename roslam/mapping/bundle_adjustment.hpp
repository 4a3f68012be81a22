// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/mapping/mapping_options.hpp"

namespace roslam {

/// A bundle adjustment problem, independent of the map: indices refer to the vectors in here.
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

/// Minimises the sum of robust (Huber) squared errors of all terms over poses and points. Solved by Ceres
/// with analytic derivatives and the sparse Schur complement, on one thread, for reproducible results.
/// should_stop is asked after each step.
BundleSummary adjust_bundle(const Camera& camera, BundleProblem& problem,
                            const BundleAdjustmentOptions& options,
                            const std::function<bool()>& should_stop = {});

/// One per term: whether its squared error is within outlier_limit() and its point in front of the camera.
std::vector<bool> bundle_inliers(const Camera& camera, const BundleProblem& problem);

}  // namespace roslam
