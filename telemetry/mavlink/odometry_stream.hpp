// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/options/mode.hpp"
#include "telemetry/mavlink/companion_clock.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"
#include "telemetry/mavlink/odometry_message.hpp"
#include "telemetry/mavlink/tracking_report.hpp"

namespace roslam::telemetry {

struct ROSLAM_EXPORT OdometryStreamOptions {
  PoseFrame frame = PoseFrame::kOdom;
  bool sends_predicted = false;  ///< also poses that were extrapolated while dynamic objects hid the scene
  double rate = 50.0;            ///< ODOMETRY messages a second at most; 1 to 200
  bool is_inertial = false;      ///< a gyroscope or accelerometer takes part: estimator type VIO, else VISION
  double map_jump = 0.05;  ///< metres by which a pose in the map is corrected that count as a reset; > 0
  double map_turn = 1.0;   ///< degrees, likewise; > 0

  /// Real time: time_usec is on the clock of this computer. Deterministic: it is the timestamp of the frame.
  Mode mode = Mode::kRealTime;

  /// Throws OptionsError.
  void validate() const;
};

/// What was sent and what was not.
struct ROSLAM_EXPORT OdometryStreamCounts {
  std::size_t odometry = 0;          ///< messages
  std::size_t without_pose = 0;      ///< frames: silence, as there is no pose
  std::size_t predicted_unsent = 0;  ///< frames whose pose was extrapolated, without sends_predicted
  std::size_t above_rate = 0;        ///< frames left out as they come faster than `rate`
  std::size_t not_finite = 0;        ///< poses
  std::size_t map_jumps = 0;         ///< corrections of the map that raised the counter (PoseFrame::kMap)
  std::size_t texts_left_out = 0;    ///< as too many came in a short time
};

/// Decides by the state of tracking what an autopilot is sent: ODOMETRY for each pose, silence where there is
/// none, never a pose twice; a reset counter that rises where the poses before and after do not belong
/// together; a text where the state changes. Not thread safe.
class ROSLAM_EXPORT OdometryStream {
 public:
  /// Throws OptionsError.
  explicit OdometryStream(const OdometryStreamOptions& options);

  /// The messages for a frame; frames in the order of time.
  std::vector<MavlinkMessage> add(const TrackingReport& report);

  /// What a heartbeat says of the newest frame.
  MavlinkState state() const;

  const OdometryStreamCounts& counts() const { return counts_; }

 private:
  void note_state(const TrackingReport& report, std::vector<MavlinkMessage>& messages);
  void note_pose(const TrackingReport& report, std::vector<MavlinkMessage>& messages);
  bool is_due(std::uint64_t time);
  bool is_sent(const TrackingReport& report);
  std::optional<OdometryMessage> message(const TrackingReport& report);
  void count_map_jump(const Odometry& odometry);
  void say(MavlinkSeverity severity, std::string_view words, double timestamp,
           std::vector<MavlinkMessage>& messages);

  OdometryStreamOptions options_;
  CompanionClock clock_;
  OdometryStreamCounts counts_;
  TrackingState state_ = TrackingState::kInitialising;
  bool has_had_pose_ = false;
  bool is_lost_ = false;               // there was a pose, and now there is none
  std::optional<std::size_t> resets_;  // of the odometry before
  SubmapId submap_, newest_submap_;
  std::optional<SE3> T_map_odom_;    // of the odometry before
  std::optional<double> due_;        // microseconds: before it no message is sent
  double texts_ = 0.0;               // that may be sent
  std::optional<double> last_text_;  // timestamp
};

}  // namespace roslam::telemetry
