// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/flight_view.hpp"

#include <algorithm>
#include <utility>

#include "roslam/common/formatted.hpp"
#include "telemetry/view/frame_image.hpp"

namespace roslam::telemetry {

namespace {
constexpr auto kImageInterval = std::chrono::milliseconds(200);
constexpr auto kLooks = std::chrono::seconds(1);  // after the last request for an image
constexpr std::size_t kLongestLog = 200;
constexpr std::size_t kMostWarnings = 10;

double seconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}
}  // namespace

FlightView::FlightView(const Slam& slam, Setup setup) : slam_(slam), setup_(std::move(setup)) {
  status_.run = setup_.run;
  status_.source = setup_.source;
  status_.in_source = setup_.in_source;
  status_.can_save = static_cast<bool>(setup_.save);
  status_.can_stop = static_cast<bool>(setup_.stop);
  status_.can_pause = static_cast<bool>(setup_.pause);
  status_.has_images = true;
  newest_ = state_since_ = seconds_[0].begun = Clock::now();
  seconds_.fill(seconds_[0]);
}

void FlightView::add(const Frame& frame, const FrameResult& result) {
  take_picture(frame, result);
  const std::scoped_lock lock(mutex_);
  note(result);
  const auto now = Clock::now();
  const bool is_first = status_.processed == 0;
  const std::size_t missed = !is_first && result.index > status_.frame ? result.index - status_.frame - 1 : 0;
  if (now - seconds_[second_].begun >= std::chrono::seconds(1)) {
    second_ = (second_ + 1) % seconds_.size();
    seconds_[second_] = {now, 0, 0};
  }
  ++seconds_[second_].processed;
  seconds_[second_].dropped += missed;
  status_.dropped += missed;
  ++status_.processed;
  status_.tracked += result.T_world_camera ? 1 : 0;
  status_.keyframes += result.is_keyframe ? 1 : 0;
  status_.frame = result.index;
  status_.timestamp = result.timestamp;
  if (is_first) status_.begun = result.timestamp;
  status_.quality = result.quality;
  status_.latency = result.latency;
  status_.inliers = result.inliers;
  status_.T_world_camera = result.T_world_camera;
  if (result.T_world_camera) status_.submap = result.submap;
  if (status_.phase == RunPhase::kStarting) status_.phase = RunPhase::kFlying;
  newest_ = now;
}

// What is worth a line in the log. mutex_ is held.
void FlightView::note(const FrameResult& result) {
  const TrackingState before = status_.state;
  if (result.state != before) {
    if (is_lost(result.state) && !is_lost(before))
      write(result.timestamp, true, "tracking lost: " + std::string(describe(result.no_pose)));
    if (result.state == TrackingState::kTracking && is_lost(before))
      write(result.timestamp, false, "tracking again");
    if (result.state == TrackingState::kPredicted)
      write(result.timestamp, false, "moving objects hide the scene: the pose is predicted");
    status_.state = result.state;
    state_since_ = Clock::now();
  }
  if (result.T_world_camera && (!has_seen_submap_ || result.submap != status_.submap)) {
    write(result.timestamp, false,
          (has_seen_submap_ ? "now in submap " : "map begun: submap ") + std::to_string(result.submap.value));
    has_seen_submap_ = true;
  }
  if (result.withdrawn > 0)
    write(result.timestamp, true, std::to_string(result.withdrawn) + " poses withdrawn");
  for (const std::string& warning : result.warnings) {
    write(result.timestamp, true, warning);
    if (status_.warnings.size() < kMostWarnings) status_.warnings.push_back(warning);
  }
}

// mutex_ is held.
void FlightView::write(double timestamp, bool is_warning, std::string text) const {
  log_.push_back({++log_number_, timestamp, is_warning, std::move(text)});
  if (log_.size() > kLongestLog) log_.pop_front();
}

// Images are not changed after they were given: a reference is enough.
void FlightView::take_picture(const Frame& frame, const FrameResult& result) {
  const auto now = Clock::now();
  if (now.time_since_epoch().count() - looked_at_.load() > Clock::duration(kLooks).count()) return;
  if (now - pictured_ < kImageInterval) return;
  pictured_ = now;
  auto picture = std::make_shared<Picture>();
  *picture = {++pictures_, frame.colour, result.dynamic_objects.mask, result.points, result.removed_points};
  const std::scoped_lock lock(mutex_);
  picture_ = std::move(picture);
}

std::string FlightView::image(std::uint64_t& number) {
  looked_at_ = Clock::now().time_since_epoch().count();
  const std::scoped_lock encoding(encoding_);
  std::shared_ptr<const Picture> picture;
  {
    const std::scoped_lock lock(mutex_);
    picture = picture_;
  }
  if (!picture || picture->number == number) return {};
  number = picture->number;
  if (picture != encoded_) {
    jpeg_ = frame_jpeg(picture->colour, picture->mask, picture->points, picture->removed_points);
    encoded_ = picture;
  }
  return jpeg_;
}

void FlightView::set_phase(RunPhase phase) {
  const std::scoped_lock lock(mutex_);
  if (phase == status_.phase) return;
  status_.phase = phase;
  if (phase == RunPhase::kSaving || phase == RunPhase::kEnded)
    status_.can_pause = status_.can_save = status_.can_stop = false;
  if (phase == RunPhase::kSaving) write(status_.timestamp, false, "flight over: results are being written");
  if (phase == RunPhase::kEnded) write(status_.timestamp, false, "run ended: results are written");
  if (phase == RunPhase::kPaused) write(status_.timestamp, false, "paused");
}

ViewStatus FlightView::status() const {
  const std::scoped_lock lock(mutex_);
  const auto now = Clock::now();
  ViewStatus result = status_;
  result.log_number = log_number_;
  result.since_frame = seconds(now - newest_);
  result.state_seconds = seconds(now - state_since_);
  std::size_t processed = 0, dropped = 0;
  for (const Second& second : seconds_) {
    if (now - second.begun > std::chrono::seconds(6)) continue;
    processed += second.processed;
    dropped += second.dropped;
  }
  if (processed + dropped > 0)
    result.recent_drops = static_cast<double>(dropped) / static_cast<double>(processed + dropped);
  const Second& last = seconds_[second_];
  const Second& before = seconds_[(second_ + seconds_.size() - 1) % seconds_.size()];
  const double time = seconds(now - before.begun);
  if (time > 0.2) result.fps = static_cast<double>(last.processed + before.processed) / time;
  return result;
}

std::vector<ClosedLoop> FlightView::loops() const {
  const std::vector<ClosedLoop> loops = slam_.loops();
  const std::scoped_lock lock(mutex_);
  for (; known_loops_ < loops.size(); ++known_loops_) {
    const ClosedLoop& loop = loops[known_loops_];
    write(status_.timestamp, false,
          (loop.merges_submaps ? "submaps merged" : "loop closed") + std::string(": keyframe ") +
              std::to_string(loop.keyframe.value) + " sees " + std::to_string(loop.matched_keyframe.value) +
              formatted(", moved by %.2f m", loop.moved));
  }
  return loops;
}

std::vector<LogEntry> FlightView::log(std::uint32_t since) const {
  const std::scoped_lock lock(mutex_);
  std::vector<LogEntry> entries;
  for (const LogEntry& entry : log_)
    if (entry.number > since) entries.push_back(entry);
  return entries;
}

std::string FlightView::execute(ViewCommand command) {
  const ViewStatus now = status();
  if (command == ViewCommand::kSave && now.can_save) {
    setup_.save();
    const std::scoped_lock lock(mutex_);
    write(status_.timestamp, false, "saving the map and the trajectory");
    return {};
  }
  if (command == ViewCommand::kStop && now.can_stop) {
    setup_.stop();
    return {};
  }
  const bool pauses = command == ViewCommand::kPause || command == ViewCommand::kResume;
  if (pauses && now.can_pause) {
    setup_.pause(command == ViewCommand::kPause);
    set_phase(command == ViewCommand::kPause ? RunPhase::kPaused : RunPhase::kFlying);
    return {};
  }
  return pauses ? "a camera cannot be paused, and a run that is over neither" : "the run is over";
}

}  // namespace roslam::telemetry
