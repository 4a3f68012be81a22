// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/status_text.hpp"
#include "roslam/common/formatted.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

namespace roslam::telemetry {

namespace {
using Json = nlohmann::ordered_json;

constexpr double kStalled = 1.0;      // seconds without a frame
constexpr double kLate = 0.25;        // seconds from the receipt of a frame to its result
constexpr double kManyDrops = 0.2;    // of the frames
constexpr double kPoorQuality = 0.2;  // of tracking

// One line; what is not UTF-8, such as in names of files, is replaced.
std::string in_one_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// To so many parts of one: as a decimal number it is short.
double rounded(double value, double parts) { return std::round(value * parts) / parts; }

Json pose_json(const SE3& pose) {
  const Eigen::Vector3d& p = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  Json json = Json::array();
  for (const double value : {p.x(), p.y(), p.z()}) json.push_back(rounded(value, 1e3));
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) json.push_back(rounded(value, 1e4));
  return json;
}
}  // namespace

std::string_view name_of(RunPhase phase) {
  switch (phase) {
    case RunPhase::kStarting:
      return "starting";
    case RunPhase::kFlying:
      return "flying";
    case RunPhase::kPaused:
      return "paused";
    case RunPhase::kSaving:
      return "saving";
    case RunPhase::kEnded:
      return "ended";
    case RunPhase::kRecorded:
      return "recorded";
  }
  return "unknown";
}

Health health_of(const ViewStatus& status) {
  Health health;
  if (status.phase == RunPhase::kSaving || status.phase == RunPhase::kEnded ||
      status.phase == RunPhase::kRecorded)
    return {"ended", {std::string(name_of(status.phase))}};
  std::vector<std::string>& reasons = health.reasons;
  const bool has_no_pose = is_lost(status.state);
  if (has_no_pose) reasons.push_back("lost for " + formatted("%.1f s", status.state_seconds));
  if (status.phase == RunPhase::kStarting) reasons.emplace_back("no frame yet");
  if (status.phase == RunPhase::kPaused) reasons.emplace_back("paused");
  if (status.phase == RunPhase::kFlying) {
    if (status.state == TrackingState::kInitialising) reasons.emplace_back("no map yet");
    if (status.state == TrackingState::kPredicted)
      reasons.emplace_back("the pose is predicted, moving objects hide the scene");
    if (status.state == TrackingState::kTracking && status.quality < kPoorQuality)
      reasons.emplace_back("tracking quality below 0.2");
    if (status.since_frame > kStalled)
      reasons.push_back("no frame for " + formatted("%.1f s", status.since_frame));
    if (status.latency > kLate) reasons.push_back("latency of " + formatted("%.1f ms", 1e3 * status.latency));
    if (status.recent_drops > kManyDrops)
      reasons.push_back(formatted("%.1f %% of the frames are dropped", 100.0 * status.recent_drops));
  }
  for (const std::string& warning : status.warnings) reasons.push_back(warning);
  health.status = has_no_pose ? "lost" : reasons.empty() ? "ok" : "degraded";
  return health;
}

std::string health_json(const ViewStatus& status) {
  const Health health = health_of(status);
  const Json json{{"status", health.status},
                  {"reasons", health.reasons},
                  {"run", status.run},
                  {"phase", name_of(status.phase)},
                  {"state", name_of(status.state)},
                  {"quality", rounded(status.quality, 1e3)},
                  {"latency", rounded(status.latency, 1e4)},
                  {"since_frame", rounded(status.since_frame, 1e3)},
                  {"frames", status.processed},
                  {"dropped", status.dropped}};
  return in_one_line(json) + "\n";
}

std::string metrics_text(const ViewStatus& status, const ViewCounts& counts) {
  std::string text;
  const auto add = [&text](std::string_view name, std::string_view type, std::string_view help,
                           double value) {
    text.append("# HELP roslam_").append(name).append(" ").append(help).append("\n# TYPE roslam_");
    text.append(name).append(" ").append(type).append("\nroslam_").append(name).append(" ");
    text.append(formatted("%.10g", value)).append("\n");
  };
  const auto count = [](std::size_t n) { return static_cast<double>(n); };
  add("frames_total", "counter", "Frames that were processed.", count(status.processed));
  add("frames_tracked_total", "counter", "Frames with a pose.", count(status.tracked));
  add("frames_dropped_total", "counter", "Frames of the source that were not used.", count(status.dropped));
  add("keyframes_total", "counter", "Frames that became keyframes.", count(status.keyframes));
  add("loops_total", "counter", "Loops that were closed, as of the last viewer.", count(counts.loops));
  add("tracking_quality", "gauge", "Quality of tracking, 0 to 1.", status.quality);
  add("tracking_inliers", "gauge", "Landmarks that support the pose.", status.inliers);
  add("latency_seconds", "gauge", "From the receipt of the newest frame to its result.", status.latency);
  add("frame_age_seconds", "gauge", "Since the newest frame.", status.since_frame);
  add("frames_per_second", "gauge", "Frames processed in the last seconds.", status.fps);
  const std::string health = health_of(status).status;
  text += "# HELP roslam_health How the run goes.\n# TYPE roslam_health gauge\n";
  for (const char* name : {"ok", "degraded", "lost", "ended"})
    text += "roslam_health{status=\"" + std::string(name) + "\"} " + (health == name ? "1\n" : "0\n");
  text += "# HELP roslam_tracking_state State of tracking.\n# TYPE roslam_tracking_state gauge\n";
  for (const TrackingState state :
       {TrackingState::kInitialising, TrackingState::kTracking, TrackingState::kPredicted,
        TrackingState::kRecentlyLost, TrackingState::kLost})
    text += "roslam_tracking_state{state=\"" + std::string(name_of(state)) + "\"} " +
            (status.state == state ? "1\n" : "0\n");
  add("view_viewers", "gauge", "Pages that are open.", count(counts.viewers));
  add("view_viewers_refused_total", "counter", "Pages refused, as there were too many.",
      count(counts.viewers_refused));
  add("view_viewers_dropped_total", "counter", "Pages whose events could not be sent.",
      count(counts.viewers_dropped));
  add("view_requests_refused_total", "counter", "Requests refused for their host, origin or token.",
      count(counts.requests_refused));
  add("view_cpu_seconds_total", "counter", "Processor time of the web page's threads.", counts.cpu_seconds);
  return text;
}

std::string event_json(const ViewStatus& status, const ViewCounts& counts) {
  const Health health = health_of(status);
  Json json{{"run", status.run},
            {"source", status.source},
            {"phase", name_of(status.phase)},
            {"state", name_of(status.state)},
            {"health", health.status},
            {"reasons", health.reasons},
            {"t", rounded(status.timestamp, 1e3)},
            {"begun", rounded(status.begun, 1e3)},
            {"frame", status.frame},
            {"frames", status.in_source},
            {"processed", status.processed},
            {"tracked", status.tracked},
            {"dropped", status.dropped},
            {"fps", rounded(status.fps, 10.0)},
            {"quality", rounded(status.quality, 1e3)},
            {"latency", rounded(status.latency, 1e4)},
            {"inliers", status.inliers},
            {"keyframes", status.keyframes},
            {"submap", status.submap.is_valid() ? Json(status.submap.value) : Json()},
            {"pose", status.T_world_camera ? pose_json(*status.T_world_camera) : Json()},
            {"map", counts.map_revision},
            {"loops", counts.loops},
            {"log", status.log_number},
            {"viewers", counts.viewers},
            {"can", Json::array()}};
  if (status.can_save) json["can"].push_back("save");
  if (status.can_pause) json["can"].push_back("pause");
  if (status.can_stop) json["can"].push_back("stop");
  if (status.has_images) json["can"].push_back("image");
  return in_one_line(json);
}

std::string log_json(const std::vector<LogEntry>& entries) {
  Json json = Json::array();
  for (const LogEntry& entry : entries)
    json.push_back({{"n", entry.number},
                    {"t", rounded(entry.timestamp, 1e3)},
                    {"warning", entry.is_warning},
                    {"text", entry.text}});
  return in_one_line(json);
}

std::string loops_json(const std::vector<ClosedLoop>& loops) {
  Json json = Json::array();
  for (const ClosedLoop& loop : loops)
    json.push_back({{"keyframe", loop.keyframe.value},
                    {"matched", loop.matched_keyframe.value},
                    {"moved", rounded(loop.moved, 1e3)},
                    {"merges", loop.merges_submaps}});
  return in_one_line(json);
}

}  // namespace roslam::telemetry
