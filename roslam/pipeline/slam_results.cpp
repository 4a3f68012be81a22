// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include "roslam/pipeline/slam.hpp"

namespace roslam {

std::optional<DenseMap> Slam::dense_map() const {
  if (!dense_) return std::nullopt;
  return dense_->result(main_world());
}

SavedMap Slam::snapshot() const { return SavedMap::of(camera_, map_, places_ ? &*places_ : nullptr); }

std::vector<ClosedLoop> Slam::loops() const {
  return loop_closer_ ? loop_closer_->closed() : std::vector<ClosedLoop>{};
}

std::size_t Slam::refused_loops() const { return loop_closer_ ? loop_closer_->refused() : 0; }

std::map<std::string, std::size_t> Slam::labelling_faults() const {
  auto faults = segmentation_.faults();
  for (const auto& [reason, count] : removal_.faults()) faults[reason] += count;
  if (removal_.flickers() > 0) faults["labels come and go"] += removal_.flickers();
  return faults;
}

std::map<std::string, std::size_t> Slam::restoration_faults() const {
  return restoration_ ? restoration_->faults() : std::map<std::string, std::size_t>{};
}

std::map<WorldId, std::size_t> Slam::frames_by_world() const {
  std::map<WorldId, std::size_t> frames;
  for (const auto& record : records_) {
    if (record.reference.is_valid()) ++frames[map_.world_of(record.reference)];
  }
  return frames;
}

std::set<WorldId> Slam::known_worlds() const {
  std::set<WorldId> worlds;
  for (const KeyframeId id : map_.keyframe_ids()) {
    const Keyframe& keyframe = *map_.find(id);
    if (keyframe.flight < map_.flight()) worlds.insert(keyframe.world);
  }
  return worlds;
}

bool Slam::has_met_map() const {
  const std::set<WorldId> known = known_worlds();
  const auto frames = frames_by_world();
  return std::any_of(frames.begin(), frames.end(),
                     [&](const auto& entry) { return known.count(entry.first) > 0; });
}

WorldId Slam::main_world() const {
  auto frames = frames_by_world();
  // What was marked in the map that the flight went on from is to be where it was.
  const std::set<WorldId> known = known_worlds();
  const auto in_map = [&](const auto& entry) { return known.count(entry.first) > 0; };
  if (std::any_of(frames.begin(), frames.end(), in_map))
    std::erase_if(frames, [&](const auto& entry) { return !in_map(entry); });
  const auto most = std::max_element(frames.begin(), frames.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most != frames.end() ? most->first : WorldId{0};
}

std::map<WorldId, std::size_t> Slam::frames_apart() const {
  auto frames = frames_by_world();
  frames.erase(main_world());
  return frames;
}

Trajectory Slam::trajectory() const {
  Trajectory result;
  const WorldId world = main_world();
  for (const auto& record : records_) {
    if (!record.reference.is_valid() || map_.world_of(record.reference) != world) continue;
    const SE3 T_camera_world = record.T_camera_reference * map_.T_camera_world(record.reference);
    result.push_back({record.timestamp, T_camera_world.inverse()});
  }
  return result;
}

Trajectory Slam::keyframes() const { return map_.trajectory(map_.flight(), main_world()); }

StageTimes Slam::times() const {
  StageTimes all = times_;
  all.add_all(mapping_.times());
  all.add_all(closing_.times());
  all.add_all(segmentation_.times());
  if (restoration_) all.add_all(restoration_->times());
  if (dense_) all.add_all(dense_->times());
  return all;
}

}  // namespace roslam
