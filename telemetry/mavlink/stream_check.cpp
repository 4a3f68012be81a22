// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/stream_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "roslam/common/formatted.hpp"
#include "roslam/geometry/se3.hpp"
#include "telemetry/mavlink/mavlink_link.hpp"

namespace roslam::telemetry {

namespace {
constexpr double kLongGap = 0.2;  // seconds: beyond it PX4 does not begin to use the poses

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values.front(), values[values.size() / 2], values.back()};
}

double sigma_of(const std::array<float, 21>& covariance, std::array<std::size_t, 3> diagonal) {
  double sum = 0.0;
  for (const std::size_t i : diagonal) sum += static_cast<double>(covariance[i]);
  return std::sqrt(sum);
}

Eigen::Vector3d vector_of(const std::array<float, 3>& v) { return Eigen::Vector3f(v.data()).cast<double>(); }

Eigen::Quaterniond attitude_of(const OdometryMessage& m) {
  return Eigen::Quaternionf(m.attitude[0], m.attitude[1], m.attitude[2], m.attitude[3])
      .cast<double>()
      .normalized();
}

// The larger of roll and pitch, degrees.
double tilt_of(const OdometryMessage& message) {
  const Eigen::Matrix3d R = attitude_of(message).toRotationMatrix();
  const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  return std::max(std::abs(roll), std::abs(pitch)) * 180.0 / std::numbers::pi;
}

// Takes the messages one after the other.
class Measure {
 public:
  void add_frame(const TrackingReport& report) {
    ++share_of(report.state).frames;
    if (!first_) first_ = report.timestamp;
    last_ = report.timestamp;
    is_broken_ |= !report.odometry.has_value();
  }

  void add(const TrackingReport& report, const MavlinkMessage& message) {
    count_bytes(encode(message, MavlinkId{}, 0).size());
    if (const auto* text = std::get_if<StatusTextMessage>(&message))
      check_.texts.push_back(formatted("%.3f s ", report.timestamp) + std::string(text->words()));
    const auto* odometry = std::get_if<OdometryMessage>(&message);
    if (odometry == nullptr) return;
    ++share_of(report.state).messages;
    if (before_) compare(*before_, *odometry);
    if (!before_) check_.first_tilt = tilt_of(*odometry);
    position_sigmas_.push_back(sigma_of(odometry->pose_covariance, {0, 6, 11}));
    angle_sigmas_.push_back(sigma_of(odometry->pose_covariance, {15, 18, 20}));
    before_ = *odometry;
    is_broken_ = false;
  }

  StreamCheck result() {
    const double heartbeat = static_cast<double>(encode(HeartbeatMessage{}, MavlinkId{}, 0).size());
    check_.duration = first_ ? last_ - *first_ : 0.0;
    const double median = spread_of(intervals_).median;
    check_.rate = median > 0.0 ? 1.0 / median : 0.0;
    check_.position_sigma = spread_of(std::move(position_sigmas_));
    check_.angle_sigma = spread_of(std::move(angle_sigmas_));
    double all = 0.0;
    for (const auto& [second, bytes] : bytes_) {
      check_.most_bytes = std::max(check_.most_bytes, bytes + heartbeat);
      all += bytes;
    }
    if (check_.duration > 0.0) check_.bytes_per_second = all / check_.duration + heartbeat;
    return std::move(check_);
  }

 private:
  StateShare& share_of(TrackingState state) {
    const auto found = std::find_if(check_.states.begin(), check_.states.end(),
                                    [state](const StateShare& one) { return one.state == state; });
    if (found != check_.states.end()) return *found;
    return check_.states.emplace_back(StateShare{state, 0, 0});
  }

  void count_bytes(std::size_t bytes) {
    bytes_[static_cast<std::int64_t>(std::floor(last_))] += static_cast<double>(bytes);
  }

  void compare(const OdometryMessage& before, const OdometryMessage& now) {
    const double interval =
        1e-6 * (static_cast<double>(now.time_usec) - static_cast<double>(before.time_usec));
    check_.longest_gap = std::max(check_.longest_gap, interval);
    if (interval > kLongGap) ++check_.long_gaps;
    if (!is_broken_) {
      intervals_.push_back(interval);
      check_.longest_gap_tracking = std::max(check_.longest_gap_tracking, interval);
    }
    if (before.reset_counter != now.reset_counter) {
      ++check_.resets;
      return;
    }
    const Eigen::Vector3d step = vector_of(now.position) - vector_of(before.position);
    const Eigen::Vector3d velocity = attitude_of(now) * vector_of(now.velocity);
    check_.largest_step = std::max(check_.largest_step, step.norm());
    check_.largest_surprise = std::max(check_.largest_surprise, (step - velocity * interval).norm());
  }

  StreamCheck check_;
  std::optional<OdometryMessage> before_;
  std::optional<double> first_;
  double last_ = 0.0;
  bool is_broken_ = false;  // a frame since the last message had no pose
  std::vector<double> intervals_, position_sigmas_, angle_sigmas_;
  std::map<std::int64_t, double> bytes_;  // by second
};

// docs/autopilot.md tells where these are from.
std::vector<StreamRule> rules_of(const StreamCheck& check) {
  constexpr double kPx4Rate = 29.0;  // 30 Hz of a camera that is a little slow
  constexpr double kArduPilotRate = 4.0, kStopGap = 0.4, kHealthyGap = 0.3, kLevel = 10.0, kGate = 0.5;
  const bool has_any = check.counts.odometry > 0;
  const std::string gap = formatted("%.0f ms while tracking", 1e3 * check.longest_gap_tracking);
  const std::string any_gap = formatted("%.0f ms", 1e3 * check.longest_gap);
  const std::string rate = formatted("%.1f Hz", check.rate);
  return {
      {"both", "poses are sent", std::to_string(check.counts.odometry) + " messages", has_any},
      {"PX4", "rate of 30 Hz", rate, check.rate >= kPx4Rate},
      {"ArduPilot", "rate of at least 4 Hz", rate, check.rate >= kArduPilotRate},
      {"PX4", "gaps of at most 200 ms while tracking", gap,
       has_any && check.longest_gap_tracking <= kLongGap},
      {"PX4", "no gap of more than 400 ms: it stops using vision", any_gap,
       has_any && check.longest_gap <= kStopGap},
      {"ArduPilot", "no gap of more than 300 ms: the sensor counts as unhealthy", any_gap,
       has_any && check.longest_gap <= kHealthyGap},
      {"ArduPilot", "roll and pitch within 10 degrees of level at the start",
       formatted("%.1f degrees", check.first_tilt), has_any && check.first_tilt <= kLevel},
      {"PX4", "steps without a reset within 0.5 m of the velocity (5 sigma of EKF2_EVP_NOISE)",
       formatted("%.3f m", check.largest_surprise), has_any && check.largest_surprise <= kGate},
      {"both", "covariances are known and positive", formatted("least %.4f m", check.position_sigma.least),
       has_any && check.position_sigma.least > 0.0 && std::isfinite(check.position_sigma.most)}};
}
}  // namespace

bool StreamCheck::is_ready() const {
  return std::all_of(rules.begin(), rules.end(), [](const StreamRule& rule) { return rule.is_met; });
}

StreamCheck check_stream(std::span<const TrackingReport> reports, OdometryStreamOptions options) {
  options.mode = Mode::kDeterministic;  // by the timestamps
  OdometryStream stream(options);
  Measure measure;
  for (const TrackingReport& report : reports) {
    measure.add_frame(report);
    for (const MavlinkMessage& message : stream.add(report)) measure.add(report, message);
  }
  StreamCheck check = measure.result();
  check.counts = stream.counts();
  check.rules = rules_of(check);
  return check;
}

}  // namespace roslam::telemetry
