// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/places/vocabulary.hpp"

namespace roslam {

/// A keyframe that has words in common with a picture.
struct SimilarKeyframe {
  KeyframeId keyframe;
  double similarity = 0.0;  ///< 0 to 1
};

/// Finds keyframes that look like a picture: for each word, the keyframes that have it. Not thread safe:
/// whoever shares it guards it.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary);

  /// The words of a view, without points on things that may move.
  BagOfWords describe(const ObservedFrame& view) const;

  /// Does nothing if the keyframe is in already, or has no words. Words beyond the vocabulary are left out.
  void add(KeyframeId keyframe, BagOfWords bag);
  void remove(KeyframeId keyframe);

  /// Removes those that are not to be kept.
  void retain(const std::function<bool(KeyframeId)>& keeps);

  /// Nullptr if the keyframe is not in.
  const BagOfWords* find(KeyframeId keyframe) const;

  /// Keyframes with words in common, most similar first, then oldest first. accepts: leaves others out.
  std::vector<SimilarKeyframe> similar(const BagOfWords& bag,
                                       const std::function<bool(KeyframeId)>& accepts = {}) const;

  std::size_t size() const { return size_; }
  const Vocabulary& vocabulary() const { return *vocabulary_; }

 private:
  struct Entry {
    KeyframeId keyframe;
    float weight;
  };
  std::shared_ptr<const Vocabulary> vocabulary_;
  std::vector<std::vector<Entry>> having_;  // by word
  std::vector<BagOfWords> bags_;            // by keyframe id; empty: not in
  std::size_t size_ = 0;
};

}  // namespace roslam
