// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "evaluation/association.hpp"
#include "evaluation/statistics.hpp"
#include "roslam/geometry/alignment.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::evaluation {

struct TrajectoryErrorOptions {
  AssociationOptions association;
  AlignmentModel alignment = AlignmentModel::kRigid;
  double span = 1.0;           ///< seconds, > 0: interval of the longer relative pose error
  double wrong_metres = 0.08;  ///< > 0: error of a step from which on a frame is wrong
  double wrong_degrees = 4.0;  ///< > 0: the same of its rotation

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// The absolute error of one pose, as drawn in figures.
struct PoseError {
  double timestamp = 0.0;    ///< seconds, of the estimate
  Eigen::Vector3d truth;     ///< metres
  Eigen::Vector3d estimate;  ///< metres, aligned to the truth
  double error = 0.0;        ///< metres
};

struct RelativeError {
  Statistics translation;  ///< metres
  Statistics rotation;     ///< degrees
};

/// A frame whose step from the tracked frame before is off by more than the limits.
struct WrongFrame {
  double timestamp = 0.0;  ///< seconds
  double metres = 0.0;     ///< error of the step
  double degrees = 0.0;
};

/// How well an estimated trajectory follows the true one, after Sturm, Engelhard, Endres, Burgard, Cremers:
/// "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012. With true poses Q_i, estimated poses
/// P_i:
///   ATE:  F_i = Q_i^-1 S P_i with S the least-squares alignment; statistics of |trans(F_i)|
///   RPE:  E_i = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) with j the pose one step after i; of |trans(E_i)| and
///   angle(E_i)
struct TrajectoryError {
  std::size_t pairs = 0;
  std::size_t truth_poses = 0;
  std::size_t estimate_poses = 0;
  double coverage = 0.0;     ///< share of the truth's duration that the pairs cover, without gaps; in [0, 1]
  double path_length = 0.0;  ///< metres along the truth, from the first pair to the last
  Alignment alignment;       ///< S, from the estimate's world frame to the truth's
  Statistics ate;            ///< metres
  double ate_percent =
      0.0;                  ///< RMSE of the ATE as a percentage of path_length; NaN if the truth did not move
  RelativeError rpe_frame;  ///< over consecutive pairs; the steps across gaps in tracking are left out
  RelativeError rpe_span;   ///< over options.span seconds
  std::vector<WrongFrame> wrong_frames;  ///< steps across gaps in tracking included
  std::vector<PoseError> poses;          ///< one a pair, in the order of time
};

/// Throws InputError if the trajectories do not overlap in time (naming both ranges), if fewer than three
/// poses pair up, or if the alignment is not determined.
TrajectoryError evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryErrorOptions& options = {});

/// The longest step between consecutive poses that is not a gap: three times the median step. Relative to the
/// data, so that a trajectory of keyframes is not all gaps.
double longest_step(const std::vector<double>& timestamps);

}  // namespace roslam::evaluation
