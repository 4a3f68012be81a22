// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tracking_state.hpp"

namespace roslam {

std::string_view name_of(TrackingState state) {
  switch (state) {
    case TrackingState::kInitialising:
      return "initialising";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kPredicted:
      return "predicted";
    case TrackingState::kRecentlyLost:
      return "recently lost";
    case TrackingState::kLost:
      return "lost";
  }
  return "unknown";
}

}  // namespace roslam
