// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/relocaliser.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"

namespace roslam {

void RelocaliserOptions::validate() const {
  if (candidates < 1) throw OptionsError("relocaliser.candidates must be at least 1");
  if (min_inliers < 6) throw OptionsError("relocaliser.min_inliers must be at least 6");
}

std::optional<VerifiedMatch> Relocaliser::find(const Map& map, const ObservedFrame& frame,
                                               std::span<const KeyframeId> similar, bool search_all) {
  const auto candidates = static_cast<std::size_t>(options_.candidates);
  const auto by_similarity = similar.first(std::min(similar.size(), candidates));
  for (const KeyframeId id : by_similarity) {
    if (auto match = verifier_.match(map, id, frame, options_.min_inliers)) return match;
  }
  std::vector<KeyframeId> keyframes = map.keyframe_ids();
  std::reverse(keyframes.begin(), keyframes.end());
  if (keyframes.empty()) return std::nullopt;
  if (!search_all) next_ = 0;
  const auto tries = std::min(candidates, keyframes.size());
  for (std::size_t i = 0; i < tries; ++i) {
    const KeyframeId id = keyframes[(next_ + i) % keyframes.size()];
    const bool is_tried = std::find(by_similarity.begin(), by_similarity.end(), id) != by_similarity.end();
    if (is_tried) continue;
    if (auto match = verifier_.match(map, id, frame, options_.min_inliers)) return match;
  }
  if (search_all) next_ = (next_ + tries) % keyframes.size();
  return std::nullopt;
}

}  // namespace roslam
