// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/place_recognition/vocabulary.hpp"

namespace roslam {

/// A keyframe that shares words with an image.
struct SimilarKeyframe {
  KeyframeId keyframe;
  double similarity = 0.0;  ///< 0 to 1
};

/// Finds keyframes similar to an image, by an inverted index from words to keyframes. Not thread safe: guard
/// a shared one.
class KeyframeDatabase {
 public:
  explicit KeyframeDatabase(std::shared_ptr<const Vocabulary> vocabulary);

  /// The bag of words of a frame, without points on movable objects.
  BagOfWords describe(const ObservedFrame& frame) const;

  /// Does nothing if the keyframe is in already, or has no words. Words beyond the vocabulary are ignored.
  void add(KeyframeId keyframe, BagOfWords bag);
  void remove(KeyframeId keyframe);

  /// Removes the keyframes for which keeps returns false.
  void retain(const std::function<bool(KeyframeId)>& keeps);

  /// Nullptr if the keyframe is not in.
  const BagOfWords* find(KeyframeId keyframe) const;

  /// Keyframes with words in common, most similar first, then oldest first. accepts: filter, empty = all.
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
  std::vector<std::vector<Entry>> inverted_index_;  // by word
  std::vector<BagOfWords> bags_;                    // by keyframe id; empty: not in
  std::size_t size_ = 0;
};

}  // namespace roslam
