// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/local_map.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"

namespace roslam {

void LocalMapOptions::validate() const {
  if (max_keyframes < 1) throw OptionsError("local_map.max_keyframes must be at least 1");
  if (neighbours < 0) throw OptionsError("local_map.neighbours must not be negative");
}

void LocalMap::update(const Map& map, const std::vector<LandmarkId>& seen, KeyframeId fallback) {
  collect_keyframes(map, seen, fallback);
  collect_landmarks(map);
}

void LocalMap::collect_keyframes(const Map& map, const std::vector<LandmarkId>& seen, KeyframeId fallback) {
  std::vector<int> votes(map.keyframe_slots(), 0);
  for (const LandmarkId id : seen) {
    const Landmark* landmark = id.is_valid() ? map.find(id) : nullptr;
    if (landmark == nullptr) continue;
    for (const auto& observation : landmark->observations) ++votes[observation.keyframe.index()];
  }
  keyframes_.clear();
  for (std::uint32_t i = 0; i < votes.size(); ++i) {
    if (votes[i] > 0 && !map.is_withdrawn(KeyframeId{i})) keyframes_.push_back(KeyframeId{i});
  }
  std::stable_sort(keyframes_.begin(), keyframes_.end(),
                   [&](KeyframeId a, KeyframeId b) { return votes[a.index()] > votes[b.index()]; });
  if (keyframes_.empty() && map.find(fallback) != nullptr) keyframes_.push_back(fallback);
  reference_ = keyframes_.empty() ? KeyframeId{} : keyframes_.front();

  const auto limit = static_cast<std::size_t>(options_.max_keyframes);
  if (keyframes_.size() > limit) keyframes_.resize(limit);
  std::vector<bool> is_in(map.keyframe_slots(), false);
  for (const KeyframeId id : keyframes_) is_in[id.index()] = true;
  // Covisible keyframes of the reference add landmarks about to come into view.
  if (!keyframes_.empty()) {
    int added = 0;
    for (const auto& [id, shared] : map.covisible(reference_)) {
      if (keyframes_.size() >= limit || added >= options_.neighbours) break;
      if (is_in[id.index()] || map.is_withdrawn(id)) continue;
      is_in[id.index()] = true;
      keyframes_.push_back(id);
      ++added;
    }
  }
}

void LocalMap::collect_landmarks(const Map& map) {
  landmarks_.clear();
  is_in_.assign(map.landmark_slots(), false);
  for (const KeyframeId keyframe_id : keyframes_) {
    for (const LandmarkId id : map.find(keyframe_id)->landmarks) {
      if (!id.is_valid() || is_in_[id.index()]) continue;
      is_in_[id.index()] = true;
      landmarks_.push_back(id);
    }
  }
}

}  // namespace roslam
