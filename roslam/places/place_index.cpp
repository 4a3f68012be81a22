// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/places/place_index.hpp"

#include <algorithm>

namespace roslam {

PlaceIndex::PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary)
    : vocabulary_(std::move(vocabulary)), having_(vocabulary_->words()) {}

BagOfWords PlaceIndex::describe(const ObservedFrame& view) const {
  if (view.is_movable.empty()) return vocabulary_->describe(view.descriptors);
  std::vector<Descriptor> at_rest;
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (!view.may_move(i)) at_rest.push_back(view.descriptors[i]);
  }
  return vocabulary_->describe(at_rest);
}

void PlaceIndex::add(KeyframeId keyframe, BagOfWords bag) {
  std::erase_if(bag, [this](const auto& entry) { return entry.first >= having_.size(); });
  if (find(keyframe) != nullptr || bag.empty()) return;
  if (keyframe.index() >= bags_.size()) bags_.resize(keyframe.index() + 1);
  for (const auto& [word, weight] : bag) having_[word].push_back({keyframe, weight});
  bags_[keyframe.index()] = std::move(bag);
  ++size_;
}

void PlaceIndex::remove(KeyframeId keyframe) {
  if (find(keyframe) == nullptr) return;
  for (const auto& [word, weight] : bags_[keyframe.index()]) {
    std::erase_if(having_[word], [&](const Entry& entry) { return entry.keyframe == keyframe; });
  }
  bags_[keyframe.index()] = {};
  --size_;
}

void PlaceIndex::retain(const std::function<bool(KeyframeId)>& keeps) {
  for (std::uint32_t i = 0; i < bags_.size(); ++i) {
    if (!bags_[i].empty() && !keeps(KeyframeId{i})) remove(KeyframeId{i});
  }
}

const BagOfWords* PlaceIndex::find(KeyframeId keyframe) const {
  if (keyframe.index() >= bags_.size() || bags_[keyframe.index()].empty()) return nullptr;
  return &bags_[keyframe.index()];
}

std::vector<SimilarKeyframe> PlaceIndex::similar(const BagOfWords& bag,
                                                 const std::function<bool(KeyframeId)>& accepts) const {
  // What two bags share is the sum of the lesser weights: see similarity().
  std::vector<double> shared(bags_.size(), 0.0);
  for (const auto& [word, weight] : bag) {
    for (const auto& entry : having_[word]) {
      shared[entry.keyframe.index()] += static_cast<double>(std::min(weight, entry.weight));
    }
  }
  std::vector<SimilarKeyframe> result;
  for (std::uint32_t i = 0; i < shared.size(); ++i) {
    const KeyframeId id{i};
    if (shared[i] > 0.0 && (!accepts || accepts(id))) result.push_back({id, shared[i]});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.similarity > b.similarity; });
  return result;
}

}  // namespace roslam
