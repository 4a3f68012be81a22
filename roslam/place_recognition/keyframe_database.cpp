// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/keyframe_database.hpp"

#include <algorithm>

namespace roslam {

KeyframeDatabase::KeyframeDatabase(std::shared_ptr<const Vocabulary> vocabulary)
    : vocabulary_(std::move(vocabulary)), inverted_index_(vocabulary_->words()) {}

BagOfWords KeyframeDatabase::describe(const ObservedFrame& frame) const {
  if (frame.is_movable.empty()) return vocabulary_->describe(frame.descriptors);
  std::vector<Descriptor> static_descriptors;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (!frame.may_move(i)) static_descriptors.push_back(frame.descriptors[i]);
  }
  return vocabulary_->describe(static_descriptors);
}

void KeyframeDatabase::add(KeyframeId keyframe, BagOfWords bag) {
  std::erase_if(bag, [this](const auto& entry) { return entry.first >= inverted_index_.size(); });
  if (find(keyframe) != nullptr || bag.empty()) return;
  if (keyframe.index() >= bags_.size()) bags_.resize(keyframe.index() + 1);
  for (const auto& [word, weight] : bag) inverted_index_[word].push_back({keyframe, weight});
  bags_[keyframe.index()] = std::move(bag);
  ++size_;
}

void KeyframeDatabase::remove(KeyframeId keyframe) {
  if (find(keyframe) == nullptr) return;
  for (const auto& [word, weight] : bags_[keyframe.index()]) {
    std::erase_if(inverted_index_[word], [&](const Entry& entry) { return entry.keyframe == keyframe; });
  }
  bags_[keyframe.index()] = {};
  --size_;
}

void KeyframeDatabase::retain(const std::function<bool(KeyframeId)>& keeps) {
  for (std::uint32_t i = 0; i < bags_.size(); ++i) {
    if (!bags_[i].empty() && !keeps(KeyframeId{i})) remove(KeyframeId{i});
  }
}

const BagOfWords* KeyframeDatabase::find(KeyframeId keyframe) const {
  if (keyframe.index() >= bags_.size() || bags_[keyframe.index()].empty()) return nullptr;
  return &bags_[keyframe.index()];
}

std::vector<SimilarKeyframe> KeyframeDatabase::similar(const BagOfWords& bag,
                                                       const std::function<bool(KeyframeId)>& accepts) const {
  // Similarity of two bags is the sum of the lesser weight of each word: see similarity().
  std::vector<double> shared(bags_.size(), 0.0);
  for (const auto& [word, weight] : bag) {
    for (const auto& entry : inverted_index_[word]) {
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
