// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/missing_depth.hpp"

#include <algorithm>
#include <string>

namespace roslam {

namespace {
std::string milliseconds(std::int64_t nanoseconds) { return std::to_string(nanoseconds / 1'000'000); }
}  // namespace

void MissingDepth::add(std::optional<std::int64_t> nearest, std::int64_t most) {
  if (!nearest || *nearest <= most) {
    ++without_;
    return;
  }
  least_ = distant_ == 0 ? *nearest : std::min(least_, *nearest);
  farthest_ = std::max(farthest_, *nearest);
  most_ = most;
  ++distant_;
}

void MissingDepth::add_to(Counts& skipped) const {
  const std::string reason = "no depth image near in time";
  count(skipped, reason, without_);
  const std::string from = milliseconds(least_), to = milliseconds(farthest_);
  count(skipped,
        reason + ": the nearest is " + (from == to ? from : from + " to " + to) +
            " ms from the colour image, at most " + milliseconds(most_) + " ms is taken as one moment",
        distant_);
}

}  // namespace roslam
