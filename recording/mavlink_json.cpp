// SPDX-License-Identifier: BSD-3-Clause
#include "recording/mavlink_json.hpp"
#include "roslam/common/formatted.hpp"

#include <cmath>

namespace roslam::recording {

namespace {
using Json = nlohmann::ordered_json;
using telemetry::MavlinkReport;
using telemetry::PoseFrame;

double rounded(double value) {
  constexpr double kFactor = 1e3;
  return std::round(value * kFactor) / kFactor;
}

std::string milliseconds(double value) { return formatted("%.1f ms", value); }
}  // namespace

nlohmann::ordered_json mavlink_json(const MavlinkReport& report) {
  const auto& stream = report.stream;
  const StageSummary& time = report.from_pose;
  return {{"address", report.address},
          {"frame", report.frame == PoseFrame::kOdom ? "odom" : "map"},
          {"sent", report.sent},
          {"bytes", report.bytes},
          {"dropped", report.dropped},
          {"frames_dropped", report.frames_dropped},
          {"odometry",
           {{"sent", stream.odometry - report.odometry_dropped},
            {"dropped", report.odometry_dropped},
            {"without_pose", stream.without_pose},
            {"predicted_unsent", stream.predicted_unsent},
            {"above_rate", stream.above_rate},
            {"not_finite", stream.not_finite},
            {"map_jumps", stream.map_jumps}}},
          {"texts_left_out", stream.texts_left_out},
          {"received", report.received},
          {"damaged", report.damaged},
          {"signed_passed_over", report.signed_frames},
          {"timesync_answered", report.timesync_answered},
          {"link_losses", report.link_losses},
          {"autopilot_heard", report.autopilot.has_value()},
          {"autopilot_system", report.autopilot ? Json(*report.autopilot) : Json(nullptr)},
          {"pose_to_packet_milliseconds",
           {{"median", rounded(time.median_ms)},
            {"p95", rounded(time.p95_ms)},
            {"p99", rounded(time.p99_ms)},
            {"max", rounded(time.max_ms)}}}};
}

std::string in_words(const MavlinkReport& report) {
  std::string words = "mavlink " + report.address + ": " +
                      std::to_string(report.stream.odometry - report.odometry_dropped) + " poses of " +
                      std::to_string(report.sent) + " messages sent, " + std::to_string(report.dropped) +
                      " dropped, " + std::to_string(report.timesync_answered) + " TIMESYNC answered, ";
  if (report.link_losses > 0) words += "link lost " + std::to_string(report.link_losses) + " times, ";
  words += report.autopilot ? "autopilot " + std::to_string(*report.autopilot) + " heard"
                            : std::string("no autopilot heard");
  if (report.from_pose.count > 0)
    words += "; from pose to packet median " + milliseconds(report.from_pose.median_ms) + ", p99 " +
             milliseconds(report.from_pose.p99_ms);
  return words;
}

}  // namespace roslam::recording
