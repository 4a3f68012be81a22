// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>

#include "roslam/common/export.hpp"
#include "roslam/slam/frame_result.hpp"

namespace roslam::telemetry {

/// What an autopilot is told about a frame: the part of its FrameResult that is small.
struct ROSLAM_EXPORT TrackingReport {
  double timestamp = 0.0;  ///< seconds, of the image
  std::chrono::steady_clock::time_point received;
  TrackingState state = TrackingState::kInitialising;
  NoPose no_pose = NoPose::kNone;
  std::optional<Odometry> odometry;
  SubmapId submap;
  bool is_clock_reset = false;

  TrackingReport() = default;
  explicit TrackingReport(const FrameResult& result)
      : timestamp(result.timestamp),
        received(result.received),
        state(result.state),
        no_pose(result.no_pose),
        odometry(result.odometry),
        submap(result.submap),
        is_clock_reset(result.is_clock_reset) {}
};

}  // namespace roslam::telemetry
