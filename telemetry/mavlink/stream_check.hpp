// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "telemetry/mavlink/odometry_stream.hpp"
#include "telemetry/mavlink/tracking_report.hpp"

namespace roslam::telemetry {

/// The frames of one state of tracking.
struct ROSLAM_EXPORT StateShare {
  TrackingState state = TrackingState::kInitialising;
  std::size_t frames = 0;
  std::size_t messages = 0;  ///< ODOMETRY
};

/// Smallest, middle and largest.
struct ROSLAM_EXPORT Spread {
  double least = 0.0, median = 0.0, most = 0.0;
};

/// A demand of an autopilot and what a stream offers.
struct ROSLAM_EXPORT StreamRule {
  std::string autopilot;  ///< PX4, ArduPilot or both
  std::string demand;
  std::string found;
  bool is_met = false;
};

/// What an autopilot would have been sent in a flight.
struct ROSLAM_EXPORT StreamCheck {
  double duration = 0.0;  ///< seconds, from the first frame to the last
  std::vector<StateShare> states;
  OdometryStreamCounts counts;
  std::vector<std::string> texts;     ///< with their times
  double rate = 0.0;                  ///< messages a second while tracking: one by the median interval
  std::size_t long_gaps = 0;          ///< of more than 200 ms between two messages
  double longest_gap = 0.0;           ///< seconds
  double longest_gap_tracking = 0.0;  ///< seconds, likewise where no frame between was without a pose
  std::size_t resets = 0;             ///< changes of the counter
  double largest_step = 0.0;          ///< metres between two messages of one counter
  double largest_surprise = 0.0;      ///< metres by which that differs from the velocity times the interval
  double first_tilt = 0.0;            ///< degrees: the larger of roll and pitch of the first message
  Spread position_sigma;              ///< metres: square root of the sum of the variances
  Spread angle_sigma;                 ///< radians, likewise
  double bytes_per_second = 0.0;      ///< mean, heartbeats included
  double most_bytes = 0.0;            ///< in one second
  std::vector<StreamRule> rules;

  bool is_ready() const;  ///< every rule is met
};

/// Passes the frames of a flight through an OdometryStream, by their timestamps.
ROSLAM_EXPORT StreamCheck check_stream(std::span<const TrackingReport> reports,
                                       OdometryStreamOptions options);

}  // namespace roslam::telemetry
