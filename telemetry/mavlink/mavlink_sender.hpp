// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/loop_closing/closed_loop.hpp"
#include "telemetry/mavlink/mavlink_link.hpp"
#include "telemetry/mavlink/mavlink_report.hpp"
#include "telemetry/mavlink/mavlink_sender_options.hpp"
#include "telemetry/mavlink/tracking_report.hpp"

namespace roslam::telemetry {

/// Tells an autopilot where it is, on a thread of its own: ODOMETRY by OdometryStream; a HEARTBEAT a second;
/// answers to TIMESYNC, on the clock of time_usec; texts of lost and found poses, new submaps, closed loops
/// and a camera that is lost. What the link does not take at once is dropped and counted. Messages are not
/// signed, and signed ones are not read.
class ROSLAM_EXPORT MavlinkSender {
 public:
  using Loops = std::function<std::vector<ClosedLoop>()>;

  /// loops: asked once a second on the sender's thread, such as Slam::loops(); may be empty. Throws as
  /// open_mavlink_link() and the options' validate() do.
  MavlinkSender(const MavlinkAddress& address, const MavlinkSenderOptions& options, Loops loops = {});

  /// As finish().
  ~MavlinkSender();

  /// Takes a frame. Never waits; frames in the order of time. May be called from any thread.
  void add(const TrackingReport& report);

  /// Sends what waits and that the run has ended, and ends the thread. Frames are ignored afterwards.
  void finish();

  /// May be called from any thread.
  MavlinkReport report() const;

  /// What is doubtful and was not yet given out, in words with the remedy: a link that is too slow, lost or
  /// back again, an autopilot that is not heard. May be called from any thread.
  std::vector<std::string> take_warnings();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::telemetry
