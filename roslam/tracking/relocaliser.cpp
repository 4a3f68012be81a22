// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/relocaliser.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"

namespace roslam {

void RelocaliserOptions::validate() const {
  if (candidates < 1) throw OptionsError("relocaliser.candidates must be at least 1");
  if (tries < 1) throw OptionsError("relocaliser.tries must be at least 1");
  if (min_inliers < 6) throw OptionsError("relocaliser.min_inliers must be at least 6");
}

std::optional<VerifiedMatch> Relocaliser::find(const Map& map, const ObservedFrame& frame,
                                               std::span<const KeyframeId> similar, bool search_all) {
  const auto candidates = static_cast<std::size_t>(options_.candidates);
  std::vector<KeyframeId> others = map.keyframe_ids();
  std::reverse(others.begin(), others.end());
  if (!search_all) others.resize(std::min(others.size(), candidates));
  choose(similar.first(std::min(similar.size(), candidates)), others);
  for (const KeyframeId id : chosen_) {
    if (auto match = verifier_.match(map, id, frame, options_.min_inliers)) return match;
  }
  return std::nullopt;
}

// The most similar keyframe in every frame; alternately one of the others and one of the similar ones in
// turn.
void Relocaliser::choose(std::span<const KeyframeId> similar, std::span<const KeyframeId> others) {
  chosen_.clear();
  const auto add = [this](KeyframeId id) {
    if (std::find(chosen_.begin(), chosen_.end(), id) == chosen_.end()) chosen_.push_back(id);
  };
  if (!similar.empty()) add(similar.front());
  const std::size_t rounds = std::max(similar.size(), others.size());
  const auto is_full = [this] { return chosen_.size() >= static_cast<std::size_t>(options_.tries); };
  for (std::size_t round = 0; round < rounds && !is_full(); ++round) {
    if (!others.empty()) add(others[next_other_++ % others.size()]);
    if (similar.size() > 1 && !is_full()) add(similar[1 + next_similar_++ % (similar.size() - 1)]);
  }
}

}  // namespace roslam
