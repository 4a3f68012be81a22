// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/association.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
// Largest tolerance: beyond it a pair says nothing about accuracy, and there would be too many candidates.
constexpr double kLargestTolerance = 1.0;
// Decimal times such as 0.5 and 0.52 are not exact in binary: their difference may exceed 0.02 by rounding
// alone.
constexpr double kTimeRounding = 1e-6;

struct Candidate {
  double difference;
  std::size_t truth;
  std::size_t estimate;
};

auto first_not_before(const Trajectory& trajectory, double time) {
  return std::lower_bound(trajectory.begin(), trajectory.end(), time,
                          [](const StampedPose& pose, double t) { return pose.timestamp < t; });
}

std::vector<Candidate> candidates_within(const Trajectory& truth, const Trajectory& estimate,
                                         double tolerance) {
  std::vector<Candidate> candidates;
  for (std::size_t e = 0; e < estimate.size(); ++e) {
    const double time = estimate[e].timestamp;
    for (auto it = first_not_before(truth, time - tolerance);
         it != truth.end() && it->timestamp <= time + tolerance; ++it) {
      const auto t = static_cast<std::size_t>(std::distance(truth.begin(), it));
      candidates.push_back({std::abs(it->timestamp - time), t, e});
    }
  }
  return candidates;
}

std::vector<PosePair> nearest_pairs(const Trajectory& truth, const Trajectory& estimate, double tolerance) {
  auto candidates = candidates_within(truth, estimate, tolerance + kTimeRounding);
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.difference, a.estimate, a.truth) < std::tie(b.difference, b.estimate, b.truth);
  });
  std::map<std::size_t, std::size_t> truth_of;  // by estimate; both strictly increasing
  for (const auto& candidate : candidates) {
    // Between the true poses of its neighbours: each true pose is used once, and both stay in time order.
    const auto next = truth_of.lower_bound(candidate.estimate);
    if (next != truth_of.end() && (next->first == candidate.estimate || next->second <= candidate.truth))
      continue;
    if (next != truth_of.begin() && std::prev(next)->second >= candidate.truth) continue;
    truth_of.emplace_hint(next, candidate.estimate, candidate.truth);
  }
  std::vector<PosePair> pairs;
  pairs.reserve(truth_of.size());
  for (const auto& [e, t] : truth_of) pairs.push_back({truth[t], estimate[e]});
  return pairs;
}

std::vector<PosePair> interpolated_pairs(const Trajectory& truth, const Trajectory& estimate,
                                         double max_gap) {
  std::vector<PosePair> pairs;
  for (const auto& pose : estimate) {
    if (const auto matched = pose_at(truth, pose.timestamp, max_gap)) pairs.push_back({*matched, pose});
  }
  return pairs;
}
}  // namespace

void AssociationOptions::validate() const {
  if (!(max_time_difference > 0.0 && max_time_difference <= kLargestTolerance)) {
    throw OptionsError("max_time_difference must lie above 0 and not above 1 s; 0.02 suits most data");
  }
  if (!(max_truth_gap > 0.0 && std::isfinite(max_truth_gap))) {
    throw OptionsError("max_truth_gap must be a positive number of seconds");
  }
}

std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const AssociationOptions& options) {
  options.validate();
  return options.interpolate ? interpolated_pairs(truth, estimate, options.max_truth_gap)
                             : nearest_pairs(truth, estimate, options.max_time_difference);
}

}  // namespace roslam::evaluation
