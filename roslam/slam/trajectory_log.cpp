// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/trajectory_log.hpp"

#include <algorithm>
#include <limits>

namespace roslam {

namespace {
// Submaps with keyframes of earlier sessions.
std::set<SubmapId> loaded_submaps(const Map& map) {
  std::set<SubmapId> submaps;
  for (const KeyframeId id : map.keyframe_ids()) {
    const Keyframe& keyframe = *map.find(id);
    if (keyframe.session < map.session()) submaps.insert(keyframe.submap);
  }
  return submaps;
}

// Replaces the poses between two measured ones by their interpolation.
void interpolate_between(Trajectory& trajectory, std::size_t from, std::size_t to) {
  const Trajectory measured{trajectory[from], trajectory[to]};
  for (std::size_t i = from + 1; i < to; ++i) {
    if (const auto pose = pose_at(measured, trajectory[i].timestamp, std::numeric_limits<double>::infinity()))
      trajectory[i] = *pose;
  }
}
}  // namespace

void TrajectoryLog::add(const TrackedFrame& frame, std::size_t index, const Map& map) {
  ++by_state_[frame.state];
  Record record{index, frame.timestamp, {}, {}};
  record.state = frame.state;
  if (frame.T_camera_world && frame.reference.is_valid()) {
    record.reference = frame.reference;
    record.T_camera_reference = *frame.T_camera_world * map.T_camera_world(frame.reference).inverse();
  }
  records_.push_back(record);
}

std::size_t TrajectoryLog::withdraw_after(double timestamp) {
  std::size_t poses = 0;
  for (std::size_t i = records_.size(); i-- > 1 && records_[i - 1].timestamp > timestamp;) {
    Record& record = records_[i - 1];
    if (!record.reference.is_valid()) continue;  // it has none
    record.reference = {};
    --by_state_[record.state];
    ++by_state_[record.state = TrackingState::kRecentlyLost];
    ++poses;
  }
  withdrawn_ += poses;
  return poses;
}

void TrajectoryLog::add_evidence(const LandmarksInView& landmarks) {
  if (landmarks.all > 0)
    records_.back().share_on_objects =
        static_cast<float>(landmarks.on_objects) / static_cast<float>(landmarks.all);
}

std::set<SubmapId> TrajectoryLog::submaps_on_objects(const Map& map) const {
  constexpr int kFewest = 5;  // frames
  constexpr double kMost = 0.5;
  struct Evidence {
    int frames = 0;
    double share = 0.0;  // sum over the frames
  };
  std::map<SubmapId, Evidence> evidence;
  for (const auto& record : records_) {
    if (!record.reference.is_valid() || !record.is_measured()) continue;
    Evidence& of_submap = evidence[map.submap_of(record.reference)];
    ++of_submap.frames;
    of_submap.share += static_cast<double>(record.share_on_objects);
  }
  std::set<SubmapId> found;
  for (const auto& [submap, e] : evidence) {
    if (e.frames >= kFewest && e.share > kMost * e.frames) found.insert(submap);
  }
  found.erase(main_submap(map));
  return found;
}

Trajectory TrajectoryLog::trajectory(const Map& map, SubmapId submap) const {
  Trajectory result;
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::size_t measured = kNone;  // position of the last one since which no pose is missing
  for (const auto& record : records_) {
    if (!record.reference.is_valid() || map.submap_of(record.reference) != submap) {
      measured = kNone;
      continue;
    }
    const SE3 T_camera_world = record.T_camera_reference * map.T_camera_world(record.reference);
    result.push_back({record.timestamp, T_camera_world.inverse()});
    if (!record.is_measured()) continue;
    if (measured != kNone) interpolate_between(result, measured, result.size() - 1);
    measured = result.size() - 1;
  }
  return result;
}

std::optional<SE3> TrajectoryLog::T_frame_keyframe(const Map& map, std::size_t frame_index,
                                                   KeyframeId keyframe, double max_age) const {
  const auto record = std::find_if(records_.rbegin(), records_.rend(),
                                   [&](const Record& candidate) { return candidate.index <= frame_index; });
  const bool is_known = record != records_.rend() && record->index == frame_index &&
                        record->reference.is_valid() &&
                        records_.back().timestamp - record->timestamp <= max_age;
  if (!is_known || map.submap_of(record->reference) != map.submap_of(keyframe)) return std::nullopt;
  return record->T_camera_reference * map.T_camera_world(record->reference) *
         map.T_camera_world(keyframe).inverse();
}

std::map<SubmapId, std::size_t> TrajectoryLog::frames_by_submap(const Map& map) const {
  std::map<SubmapId, std::size_t> frames;
  for (const auto& record : records_) {
    if (record.reference.is_valid()) ++frames[map.submap_of(record.reference)];
  }
  return frames;
}

bool TrajectoryLog::found_in_loaded_map(const Map& map) const {
  const std::set<SubmapId> loaded = loaded_submaps(map);
  const auto frames = frames_by_submap(map);
  return std::any_of(frames.begin(), frames.end(),
                     [&](const auto& entry) { return loaded.count(entry.first) > 0; });
}

SubmapId TrajectoryLog::main_submap(const Map& map) const {
  auto frames = frames_by_submap(map);
  // Coordinates of the map that was loaded stay valid.
  const std::set<SubmapId> loaded = loaded_submaps(map);
  const auto is_loaded = [&](const auto& entry) { return loaded.count(entry.first) > 0; };
  if (std::any_of(frames.begin(), frames.end(), is_loaded))
    std::erase_if(frames, [&](const auto& entry) { return !is_loaded(entry); });
  const auto most = std::max_element(frames.begin(), frames.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most != frames.end() ? most->first : SubmapId{0};
}

}  // namespace roslam
