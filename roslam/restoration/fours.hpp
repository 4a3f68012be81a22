// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace roslam {

/// Numbers of four sources, which one instruction processes.
using Four = Eigen::Array4f;

/// Number of fours that hold count numbers.
constexpr std::size_t fours_for(std::size_t count) { return (count + 3) / 4; }

/// The i-th of the numbers in fours.
inline float number_of(const std::vector<Four>& fours, std::size_t i) {
  return fours[i / 4][static_cast<Eigen::Index>(i % 4)];
}

inline float& number_of(std::vector<Four>& fours, std::size_t i) {
  return fours[i / 4][static_cast<Eigen::Index>(i % 4)];
}

}  // namespace roslam
