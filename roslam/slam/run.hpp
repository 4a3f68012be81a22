// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <stop_token>

#include "roslam/common/export.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam {

struct ROSLAM_EXPORT RunSummary {
  std::size_t dropped = 0;           ///< frames the tracker was too busy for (real-time mode)
  std::size_t longest_gap = 0;       ///< the most of these in a row
  std::size_t without_depth = 0;     ///< frames that came without a depth image or a right one
  bool interrupted = false;          ///< stopped before the source ended
  std::exception_ptr failure;        ///< what ended the run early, else null; the results until then are good
  double wall_seconds = 0.0;         ///< from the first read to the last result
  double first_pose_seconds = -1.0;  ///< from the first read to the first pose; negative = no pose
  Trajectory truth;                  ///< true poses of the frames, where the source knows them
};

/// Feeds a source through the pipeline until it ends or a stop is requested, then calls Slam::finish(). A
/// stop also cancels (Slam::cancel()), so that this returns soon. In real-time mode frames come at the pace
/// of their timestamps on a thread of their own, those of a camera as they come, and those the tracker has no
/// time for are dropped; a gap in the timestamps is waited for no longer than a second. on_frame is called on
/// the calling thread after each frame that was used. An exception of the source or the pipeline ends the run
/// and is kept in the summary, so that results can still be written.
ROSLAM_EXPORT RunSummary run_slam(FrameSource& source, Slam& slam,
                                  const std::function<void(const Frame&, const FrameResult&)>& on_frame = {},
                                  const std::stop_token& stop = {});

}  // namespace roslam
