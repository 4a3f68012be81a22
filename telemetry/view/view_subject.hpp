// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/dense/live_surface.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/loop_closing/closed_loop.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/slam/map_snapshot.hpp"
#include "roslam/tracking/tracking_state.hpp"

namespace roslam::telemetry {

/// What a run does now.
enum class RunPhase {
  kStarting,  ///< no frame has come yet
  kFlying,
  kPaused,
  kSaving,   ///< the flight is over, results are being written
  kEnded,    ///< they are written
  kRecorded  ///< a run of earlier, from its folder
};

/// One word, for the page and other programs.
std::string_view name_of(RunPhase phase);

inline bool is_lost(TrackingState state) {
  return state == TrackingState::kRecentlyLost || state == TrackingState::kLost;
}

/// How a run goes.
struct ViewStatus {
  std::string run;     ///< id; another one after a restart
  std::string source;  ///< as the user named it
  RunPhase phase = RunPhase::kStarting;
  bool can_pause = false, can_save = false, can_stop = false, has_images = false;
  std::size_t frame = 0;      ///< of the source, the newest
  std::size_t in_source = 0;  ///< 0: not known
  std::size_t processed = 0, tracked = 0;
  std::size_t dropped = 0;  ///< frames of the source that were not used
  std::size_t keyframes = 0;
  double begun = 0.0;         ///< seconds, timestamp of the first frame
  double timestamp = 0.0;     ///< seconds, of the newest frame
  double since_frame = 0.0;   ///< seconds since it came
  double recent_drops = 0.0;  ///< share of the frames of the last five seconds that were not used
  double fps = 0.0;           ///< processed, in the last second or two
  TrackingState state = TrackingState::kInitialising;
  double state_seconds = 0.0;  ///< that it has lasted
  double quality = 0.0;        ///< of tracking, 0 to 1
  double latency = 0.0;        ///< seconds from the receipt of the frame to its result
  int inliers = 0;
  SubmapId submap;  ///< that the pose is in
  std::optional<SE3> T_world_camera;
  std::uint32_t log_number = 0;       ///< of the newest entry
  std::vector<std::string> warnings;  ///< what is doubtful about the input
};

/// Something that happened, for people.
struct LogEntry {
  std::uint32_t number = 0;  ///< ascending, from 1
  double timestamp = 0.0;    ///< seconds, of the frame then
  bool is_warning = false;
  std::string text;
};

enum class ViewCommand { kSave, kPause, kResume, kStop };

/// What a server shows: a flight, or a run of earlier. Called from any thread.
class ViewSubject {
 public:
  ViewSubject() = default;
  ViewSubject(const ViewSubject&) = delete;
  ViewSubject& operator=(const ViewSubject&) = delete;
  virtual ~ViewSubject() = default;

  virtual ViewStatus status() const = 0;

  /// Null: there is none yet. Only called while somebody looks, by a thread of normal priority.
  virtual std::shared_ptr<const MapSnapshot> snapshot() const = 0;
  virtual std::vector<ClosedLoop> loops() const = 0;

  virtual SurfaceChanges surface(SubmapId submap, std::uint64_t revision, std::size_t most_points) const = 0;

  /// The newest image with what was found in it, JPEG; empty: there is none yet. number: of the image that
  /// the caller has, and of the one returned; empty if they are the same.
  virtual std::string image(std::uint64_t& number) = 0;

  /// What happened since the entry of that number.
  virtual std::vector<LogEntry> log(std::uint32_t since) const = 0;

  /// Empty: it is done. Else why not, in words.
  virtual std::string execute(ViewCommand command) = 0;
};

}  // namespace roslam::telemetry
