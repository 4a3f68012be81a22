// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tracking_options.hpp"

#include "roslam/common/error.hpp"

namespace roslam {

void TrackerOptions::validate() const {
  if (min_initial_points < 10) throw OptionsError("tracker.min_initial_points must be at least 10");
  if (min_inliers < 6) throw OptionsError("tracker.min_inliers must be at least 6");
  if (min_frame_matches < 6) throw OptionsError("tracker.min_frame_matches must be at least 6");
  if (!(min_agreement >= 0.0 && min_agreement <= 1.0))
    throw OptionsError("tracker.min_agreement must be 0 to 1");
  if (trusted_inliers < 1) throw OptionsError("tracker.trusted_inliers must be at least 1");
  if (scarce_inliers < 0) throw OptionsError("tracker.scarce_inliers must not be negative");
  if (!(hidden_share >= 0.0 && hidden_share <= 1.0))
    throw OptionsError("tracker.hidden_share must be 0 to 1");
  if (!(max_predicted >= 0.0 && max_predicted <= 60.0))
    throw OptionsError("tracker.max_predicted must be 0 to 60 seconds");
  if (!(max_wait_to_start >= 0.0 && max_wait_to_start <= 60.0))
    throw OptionsError("tracker.max_wait_to_start must be 0 to 60 seconds");
  if (new_submap_after_lost < 0) throw OptionsError("tracker.new_submap_after_lost must not be negative");
  if (recently_lost_frames < 0) throw OptionsError("tracker.recently_lost_frames must not be negative");
}

}  // namespace roslam
