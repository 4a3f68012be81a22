// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trajectory_error.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
constexpr std::size_t kMinPairs = 3;
constexpr double kGapInMedianSteps = 3.0;
// How far from the wanted span a pair of poses may be: half a step (more would let the last poses take a
// partner too near for want of a later one), and never more than this share of the span.
constexpr double kStepTolerance = 0.5;
constexpr double kSpanTolerance = 0.1;
constexpr double kTimeRounding = 1e-6;  // seconds
constexpr double kDegrees = 180.0 / std::numbers::pi;

double median_step(const std::vector<double>& timestamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < timestamps.size(); ++i) steps.push_back(timestamps[i] - timestamps[i - 1]);
  return median(std::move(steps));
}

std::string seconds(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

std::string range_of(const Trajectory& trajectory) {
  return seconds(trajectory.front().timestamp) + " to " + seconds(trajectory.back().timestamp) + " s";
}

void require_pairs(const std::vector<PosePair>& pairs, const Trajectory& truth, const Trajectory& estimate) {
  if (pairs.size() >= kMinPairs) return;
  const std::string ranges =
      "the truth runs from " + range_of(truth) + ", the estimate from " + range_of(estimate);
  const bool apart = truth.back().timestamp < estimate.front().timestamp ||
                     estimate.back().timestamp < truth.front().timestamp;
  if (pairs.empty() && apart) {
    throw InputError("truth and estimate do not overlap in time: " + ranges +
                     "; check that they belong to one recording and use one clock");
  }
  throw InputError("only " + std::to_string(pairs.size()) + " poses pair up by time, three are needed: " +
                   ranges + "; check the clocks or allow a larger time difference");
}

std::vector<double> times_of(const std::vector<PosePair>& pairs) {
  std::vector<double> times;
  times.reserve(pairs.size());
  for (const auto& pair : pairs) times.push_back(pair.estimate.timestamp);
  return times;
}

// Sums over all true poses between the pairs: at their higher rate they follow the path more closely.
double path_length(const Trajectory& truth, const StampedPose& from, const StampedPose& to) {
  double length = 0.0;
  Eigen::Vector3d last = from.T_world_camera.translation();
  for (const auto& pose : truth) {
    if (pose.timestamp <= from.timestamp || pose.timestamp >= to.timestamp) continue;
    length += (pose.T_world_camera.translation() - last).norm();
    last = pose.T_world_camera.translation();
  }
  return length + (to.T_world_camera.translation() - last).norm();
}

double coverage(const Trajectory& truth, const std::vector<double>& times) {
  const double duration = truth.back().timestamp - truth.front().timestamp;
  const double longest = longest_step(times);
  double covered = 0.0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double step = times[i] - times[i - 1];
    if (step <= longest) covered += step;
  }
  // Pairs may differ by the tolerance at either end, which can make the sum exceed the truth's duration.
  return duration > 0.0 ? std::min(1.0, covered / duration) : 0.0;
}

// The error of the motion from one pair to another.
SE3 motion_error(const PosePair& from, const PosePair& to, double scale) {
  const SE3 true_motion = from.truth.T_world_camera.inverse() * to.truth.T_world_camera;
  const SE3 motion = from.estimate.T_world_camera.inverse() * to.estimate.T_world_camera;
  return true_motion.inverse() * SE3(motion.rotation(), scale * motion.translation());
}

std::vector<WrongFrame> wrong_frames(const std::vector<PosePair>& pairs, double scale,
                                     const TrajectoryErrorOptions& options) {
  std::vector<WrongFrame> result;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const SE3 error = motion_error(pairs[i - 1], pairs[i], scale);
    const WrongFrame frame{pairs[i].estimate.timestamp, error.translation().norm(), error.angle() * kDegrees};
    if (frame.metres > options.wrong_metres || frame.degrees > options.wrong_degrees) result.push_back(frame);
  }
  return result;
}

class RelativeErrors {
 public:
  RelativeErrors(const std::vector<PosePair>& pairs, double scale) : pairs_(pairs), scale_(scale) {}

  void add(std::size_t i, std::size_t j) {
    const SE3 error = motion_error(pairs_[i], pairs_[j], scale_);
    translation_.push_back(error.translation().norm());
    rotation_.push_back(error.angle() * kDegrees);
  }

  RelativeError summary() const { return {summarise(translation_), summarise(rotation_)}; }

 private:
  const std::vector<PosePair>& pairs_;
  double scale_;
  std::vector<double> translation_;
  std::vector<double> rotation_;
};

RelativeError error_per_frame(const std::vector<PosePair>& pairs, const std::vector<double>& times,
                              double scale) {
  RelativeErrors errors(pairs, scale);
  const double longest = longest_step(times);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    if (times[i] - times[i - 1] <= longest) errors.add(i - 1, i);
  }
  return errors.summary();
}

RelativeError error_over_span(const std::vector<PosePair>& pairs, const std::vector<double>& times,
                              double span, double scale) {
  RelativeErrors errors(pairs, scale);
  const double half_step = kStepTolerance * median_step(times);
  const double tolerance = std::min(half_step, kSpanTolerance * span) + kTimeRounding;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double wanted = times[i] + span;
    auto after = std::lower_bound(times.begin(), times.end(), wanted);
    if (after != times.begin() && (after == times.end() || wanted - *std::prev(after) <= *after - wanted)) {
      --after;
    }
    const auto j = static_cast<std::size_t>(std::distance(times.begin(), after));
    if (j > i && std::abs(times[j] - wanted) <= tolerance) errors.add(i, j);
  }
  return errors.summary();
}

Alignment aligned(const std::vector<PosePair>& pairs, AlignmentModel model) {
  std::vector<Eigen::Vector3d> truth;
  std::vector<Eigen::Vector3d> estimate;
  for (const auto& pair : pairs) {
    truth.push_back(pair.truth.T_world_camera.translation());
    estimate.push_back(pair.estimate.T_world_camera.translation());
  }
  const auto alignment = align_points(estimate, truth, model);
  if (!alignment) {
    throw InputError(
        "the estimate cannot be aligned to the truth: one of them does not move, so the scale is "
        "undetermined; align without scale");
  }
  return *alignment;
}
}  // namespace

void TrajectoryErrorOptions::validate() const {
  association.validate();
  if (!(span > 0.0 && std::isfinite(span))) throw OptionsError("span must be a positive number of seconds");
  if (!(wrong_metres > 0.0)) throw OptionsError("wrong_metres must be positive");
  if (!(wrong_degrees > 0.0)) throw OptionsError("wrong_degrees must be positive");
}

double longest_step(const std::vector<double>& timestamps) {
  return kGapInMedianSteps * median_step(timestamps);
}

TrajectoryError evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryErrorOptions& options) {
  options.validate();
  if (truth.empty() || estimate.empty()) throw InputError("a trajectory without poses cannot be evaluated");
  const auto pairs = associate(truth, estimate, options.association);
  require_pairs(pairs, truth, estimate);
  const auto times = times_of(pairs);

  TrajectoryError result;
  result.pairs = pairs.size();
  result.truth_poses = truth.size();
  result.estimate_poses = estimate.size();
  result.coverage = coverage(truth, times);
  result.path_length = path_length(truth, pairs.front().truth, pairs.back().truth);
  result.alignment = aligned(pairs, options.alignment);

  std::vector<double> errors;
  for (const auto& [true_pose, pose] : pairs) {
    const Eigen::Vector3d position = result.alignment * pose.T_world_camera.translation();
    const Eigen::Vector3d true_position = true_pose.T_world_camera.translation();
    errors.push_back((position - true_position).norm());
    result.poses.push_back({pose.timestamp, true_position, position, errors.back()});
  }
  result.ate = summarise(errors);
  result.ate_percent = result.path_length > 0.0 ? 100.0 * result.ate.rmse / result.path_length
                                                : std::numeric_limits<double>::quiet_NaN();
  result.rpe_frame = error_per_frame(pairs, times, result.alignment.scale);
  result.rpe_span = error_over_span(pairs, times, options.span, result.alignment.scale);
  result.wrong_frames = wrong_frames(pairs, result.alignment.scale, options);
  return result;
}

}  // namespace roslam::evaluation
