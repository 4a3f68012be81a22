// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace roslam {

inline constexpr int kMaxRegions = 3;            ///< of a region normalisation
inline constexpr float kLowestScore = -3.0e38F;  ///< of lanes without a class

}  // namespace roslam
