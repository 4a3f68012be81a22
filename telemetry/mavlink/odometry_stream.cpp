// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/odometry_stream.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam::telemetry {

namespace {
constexpr double kMicroseconds = 1e6;

void require(bool is_right, const std::string& field) {
  if (!is_right) throw OptionsError("mavlink." + field);
}

std::uint64_t microseconds_of(double timestamp) {
  return static_cast<std::uint64_t>(std::llround(std::max(0.0, timestamp) * kMicroseconds));
}
// Why there is no pose, short enough for a text of 50 letters.
std::string_view short_words(NoPose reason) {
  switch (reason) {
    case NoPose::kNone:
      break;
    case NoPose::kNoMap:
      return "no map";
    case NoPose::kNotRecognised:
      return "place not recognised";
    case NoPose::kFewLandmarks:
      return "too few landmarks agree";
    case NoPose::kUncertain:
      return "pose not constrained by the view";
    case NoPose::kPoorFit:
      return "matches are poor";
    case NoPose::kImplausible:
      return "motion not plausible";
  }
  return "no pose";
}
}  // namespace

void OdometryStreamOptions::validate() const {
  require(rate >= 1.0 && rate <= 200.0, "rate: must be 1 to 200 messages a second");
  require(map_jump > 0.0, "map_jump: must be above 0 m");
  require(map_turn > 0.0, "map_turn: must be above 0 degrees");
}

OdometryStream::OdometryStream(const OdometryStreamOptions& options) : options_(options) {
  options.validate();
}

std::vector<MavlinkMessage> OdometryStream::add(const TrackingReport& report) {
  std::vector<MavlinkMessage> messages;
  if (auto odometry = message(report)) messages.emplace_back(*odometry);
  note_state(report, messages);
  return messages;
}

// Texts follow the pose, which is more urgent.
void OdometryStream::note_state(const TrackingReport& report, std::vector<MavlinkMessage>& messages) {
  state_ = report.state;
  if (report.odometry) return note_pose(report, messages);
  ++counts_.without_pose;
  if (!has_had_pose_ || is_lost_) return;
  is_lost_ = true;
  say(MavlinkSeverity::kWarning, "RO-SLAM: lost, " + std::string(short_words(report.no_pose)),
      report.timestamp, messages);
}

void OdometryStream::note_pose(const TrackingReport& report, std::vector<MavlinkMessage>& messages) {
  const std::size_t resets = report.odometry->resets;
  const std::string counter = ", reset counter " + std::to_string((resets + counts_.map_jumps) % 256);
  const bool is_new_submap =
      report.submap.is_valid() && (!newest_submap_.is_valid() || report.submap > newest_submap_);
  const auto tell = [&](const std::string& what) {
    say(MavlinkSeverity::kNotice, "RO-SLAM: " + what + counter, report.timestamp, messages);
  };
  if (!has_had_pose_) {
    tell("tracking");
  } else if (is_new_submap) {
    tell("new submap");
  } else if (is_lost_) {
    tell("tracking again");
  } else if (resets_ && resets != *resets_) {
    tell("position restarts");
  }
  has_had_pose_ = true;
  is_lost_ = false;
  resets_ = resets;
  if (is_new_submap) newest_submap_ = report.submap;
}

std::optional<OdometryMessage> OdometryStream::message(const TrackingReport& report) {
  // The clock sees every frame.
  const std::uint64_t time = options_.mode == Mode::kDeterministic
                                 ? microseconds_of(report.timestamp)
                                 : clock_.time_of(report.timestamp, report.received, report.is_clock_reset);
  if (report.is_clock_reset) due_.reset();
  if (!report.odometry) return std::nullopt;
  count_map_jump(*report.odometry);
  if (!is_sent(report) || !is_due(time)) return std::nullopt;
  OdometryMessage message = odometry_message(options_.frame, *report.odometry);
  message.time_usec = time;
  message.reset_counter = static_cast<std::uint8_t>((report.odometry->resets + counts_.map_jumps) % 256);
  message.estimator_type = options_.is_inertial ? kEstimatorVio : kEstimatorVision;
  ++counts_.odometry;
  return message;
}

bool OdometryStream::is_sent(const TrackingReport& report) {
  const Odometry& odometry = *report.odometry;
  if (odometry.is_predicted && !options_.sends_predicted) {
    ++counts_.predicted_unsent;
    return false;
  }
  const bool is_finite = odometry.T_odom_body.is_finite() && odometry.T_map_odom.is_finite() &&
                         odometry.linear_velocity.allFinite() && odometry.angular_velocity.allFinite();
  if (!is_finite) ++counts_.not_finite;
  return is_finite;
}

// Frames that come faster than the rate are thinned to it on average.
bool OdometryStream::is_due(std::uint64_t time) {
  constexpr double kEarly = 0.1;  // of a period: jitter of the frames
  const double period = kMicroseconds / options_.rate;
  const auto now = static_cast<double>(time);
  if (due_ && now < *due_ - kEarly * period) {
    ++counts_.above_rate;
    return false;
  }
  due_ = std::max(due_.value_or(now), now - period) + period;
  return true;
}

// The jump is that of the body, which a small turn about a distant origin moves far.
void OdometryStream::count_map_jump(const Odometry& odometry) {
  if (options_.frame == PoseFrame::kMap && T_map_odom_ && resets_ == odometry.resets) {
    const SE3 before = *T_map_odom_ * odometry.T_odom_body;
    const SE3 now = odometry.T_map_odom * odometry.T_odom_body;
    const double moved = (now.translation() - before.translation()).norm();
    const double turned = (before.inverse() * now).angle() * 180.0 / std::numbers::pi;
    if (moved > options_.map_jump || turned > options_.map_turn) ++counts_.map_jumps;
  }
  T_map_odom_ = odometry.T_map_odom;
}

// A state that flickers must not fill the link: one text a second, five at once.
void OdometryStream::say(MavlinkSeverity severity, std::string_view words, double timestamp,
                         std::vector<MavlinkMessage>& messages) {
  constexpr double kMost = 5.0, kPerSecond = 1.0;
  const double since = last_text_ ? std::max(0.0, timestamp - *last_text_) : kMost;
  texts_ = std::min(kMost, texts_ + kPerSecond * since);
  last_text_ = timestamp;
  if (texts_ < 1.0) {
    ++counts_.texts_left_out;
    return;
  }
  texts_ -= 1.0;
  messages.emplace_back(StatusTextMessage(severity, words));
}

MavlinkState OdometryStream::state() const {
  switch (state_) {
    case TrackingState::kInitialising:
      return MavlinkState::kStandby;
    case TrackingState::kTracking:
    case TrackingState::kPredicted:
      return MavlinkState::kActive;
    case TrackingState::kRecentlyLost:
    case TrackingState::kLost:
      return MavlinkState::kCritical;
  }
  return MavlinkState::kCritical;
}

}  // namespace roslam::telemetry
