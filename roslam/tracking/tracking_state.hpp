// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "roslam/common/export.hpp"

namespace roslam {

enum class TrackingState {
  kInitialising,  ///< no map yet: waiting for an image with enough points of known depth
  kTracking,      ///< the pose is known
  kPredicted,     ///< dynamic objects hide the scene; the pose is extrapolated
  kRecentlyLost,  ///< just lost; relocalising against similar and the newest keyframes
  kLost           ///< relocalising against all keyframes
};

/// In words, for messages and reports.
ROSLAM_EXPORT std::string_view name_of(TrackingState state);

}  // namespace roslam
