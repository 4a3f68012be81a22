// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/trajectory_log.hpp"

#include <algorithm>
#include <limits>

#include "roslam/map/keyframe_pose_table.hpp"

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

// Nothing for a frame that was not tracked.
TrajectoryLog::OfReference* TrajectoryLog::of_reference(const Record& record) {
  if (!record.reference.is_valid()) return nullptr;
  const std::size_t index = record.reference.index();
  if (index >= of_references_.size()) of_references_.resize(index + 1);
  return &of_references_[index];
}

void TrajectoryLog::add(const TrackedFrame& frame, std::size_t index, const Map& map) {
  ++by_state_[frame.state];
  Record record{index, frame.timestamp, {}, {}};
  record.state = frame.state;
  if (frame.T_camera_world && frame.reference.is_valid()) {
    record.reference = frame.reference;
    record.T_camera_reference = *frame.T_camera_world * map.T_camera_world(frame.reference).inverse();
  }
  records_.push_back(record);
  if (OfReference* of = of_reference(record)) {
    ++of->frames;
    of->measured += record.is_measured() ? 1 : 0;
  }
}

std::size_t TrajectoryLog::withdraw_after(double timestamp) {
  std::size_t poses = 0;
  for (std::size_t i = records_.size(); i-- > 1 && records_[i - 1].timestamp > timestamp;) {
    Record& record = records_[i - 1];
    OfReference* of = of_reference(record);
    if (of == nullptr) continue;  // it has none
    --of->frames;
    if (record.is_measured()) {
      --of->measured;
      of->share_on_objects -= static_cast<double>(record.share_on_objects);
    }
    record.reference = {};
    --by_state_[record.state];
    ++by_state_[record.state = TrackingState::kRecentlyLost];
    ++poses;
  }
  withdrawn_ += poses;
  return poses;
}

void TrajectoryLog::add_evidence(const LandmarksInView& landmarks) {
  if (landmarks.all == 0) return;
  Record& record = records_.back();
  record.share_on_objects = static_cast<float>(landmarks.on_objects) / static_cast<float>(landmarks.all);
  OfReference* of = of_reference(record);
  if (of != nullptr && record.is_measured())
    of->share_on_objects += static_cast<double>(record.share_on_objects);
}

std::set<SubmapId> TrajectoryLog::submaps_on_objects(const Map& map) const {
  constexpr int kFewest = 5;  // frames
  constexpr double kMost = 0.5;
  std::map<SubmapId, OfReference> of_submaps;
  for (std::uint32_t i = 0; i < of_references_.size(); ++i) {
    const OfReference& of = of_references_[i];
    if (of.measured == 0) continue;
    OfReference& of_submap = of_submaps[map.submap_of(KeyframeId{i})];
    of_submap.measured += of.measured;
    of_submap.share_on_objects += of.share_on_objects;
  }
  std::set<SubmapId> found;
  for (const auto& [submap, of] : of_submaps) {
    if (of.measured >= kFewest && of.share_on_objects > kMost * of.measured) found.insert(submap);
  }
  found.erase(main_submap(map));
  return found;
}

Trajectory TrajectoryLog::trajectory(const Map& map, SubmapId submap) const {
  return placed(records_, keyframe_poses(map), submap);
}

std::vector<KeyframePose> TrajectoryLog::keyframe_poses(const Map& map) {
  std::vector<KeyframePose> poses;
  poses.reserve(map.keyframe_slots());
  for (std::uint32_t i = 0; i < map.keyframe_slots(); ++i) poses.push_back(keyframe_pose(map, KeyframeId{i}));
  return poses;
}

void TrajectoryLog::copy(std::size_t begin, std::size_t end, std::vector<Record>& records) const {
  const auto first = records_.begin();
  records.insert(records.end(), first + static_cast<std::ptrdiff_t>(begin),
                 first + static_cast<std::ptrdiff_t>(std::min(end, records_.size())));
}

Trajectory TrajectoryLog::placed(const std::vector<Record>& records,
                                 const std::vector<KeyframePose>& keyframes, SubmapId submap) {
  Trajectory result;
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::size_t measured = kNone;  // position of the last one since which no pose is missing
  for (const auto& record : records) {
    const bool is_here = record.reference.is_valid() && record.reference.index() < keyframes.size() &&
                         keyframes[record.reference.index()].submap == submap;
    if (!is_here) {
      measured = kNone;
      continue;
    }
    result.push_back({record.timestamp, keyframes[record.reference.index()].T_world_camera *
                                            record.T_camera_reference.inverse()});
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
  for (std::uint32_t i = 0; i < of_references_.size(); ++i) {
    if (of_references_[i].frames > 0) frames[map.submap_of(KeyframeId{i})] += of_references_[i].frames;
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
