// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/common/stage_times.hpp"
#include "telemetry/mavlink/odometry_stream.hpp"

namespace roslam::telemetry {

/// What went to an autopilot and what came back.
struct ROSLAM_EXPORT MavlinkReport {
  std::string address;
  PoseFrame frame = PoseFrame::kOdom;
  std::size_t sent = 0;              ///< messages that the link took
  std::size_t bytes = 0;             ///< of these
  std::size_t dropped = 0;           ///< messages: the link was full or lost
  std::size_t frames_dropped = 0;    ///< of more than 64 that wait the oldest
  std::size_t odometry_dropped = 0;  ///< of the dropped messages those with a pose
  OdometryStreamCounts stream;
  std::size_t received = 0;       ///< messages that were understood
  std::size_t damaged = 0;        ///< of a wrong checksum
  std::size_t signed_frames = 0;  ///< passed over
  std::size_t timesync_answered = 0;
  std::size_t link_losses = 0;
  std::optional<int> autopilot;  ///< system number of the one that was heard; nothing: none was
  StageSummary from_pose;        ///< wall time from a pose to its packet
};

}  // namespace roslam::telemetry
