// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/features/descriptor.hpp"

namespace roslam {

using WordId = std::uint32_t;

/// The visual words of an image with their weights, by ascending word. Weights are positive and sum to 1; an
/// image without descriptors has no words.
using BagOfWords = std::vector<std::pair<WordId, float>>;

/// Similarity of two images, 0 to 1: one minus half the L1 distance of their bags (Galvez-Lopez and Tardos,
/// T-RO 2012, eq. 2).
ROSLAM_EXPORT double similarity(const BagOfWords& a, const BagOfWords& b);

struct ROSLAM_EXPORT VocabularyOptions {
  int branching = 10;      ///< children of a node
  int depth = 5;           ///< levels below the root; at most branching^depth words
  int iterations = 12;     ///< of k-medians for a node, at most
  std::uint64_t seed = 1;  ///< of the random initial medians

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Vocabulary tree that quantises binary descriptors to visual words, so that images of one place share words
/// (Nister and Stewenius, CVPR 2006; Galvez-Lopez and Tardos, T-RO 2012). Immutable, so thread safe.
class ROSLAM_EXPORT Vocabulary {
 public:
  /// Hierarchical k-medians of all descriptors of all images. Words are weighted by inverse document
  /// frequency: log(images / images with the word). progress, if given, receives the fraction done, 0 to 1.
  /// The same images in the same order and the same options give the same vocabulary. Throws OptionsError,
  /// or InputError if there are fewer descriptors than a node has children.
  static Vocabulary train(std::span<const std::vector<Descriptor>> images, const VocabularyOptions& options,
                          const std::function<void(double)>& progress = {});

  /// Throws InputError naming the file and what is wrong with it.
  static Vocabulary load(const std::filesystem::path& file);

  /// Encodes and decodes the content of such a file, without its header; name: of the file, for messages.
  std::string content() const;
  static Vocabulary decode(std::string_view content, const std::string& name);

  /// Replaces the file atomically. Throws OutputError.
  void save(const std::filesystem::path& file) const;

  /// The words of an image, weighted by their frequency in it and their rarity (tf-idf).
  BagOfWords describe(std::span<const Descriptor> descriptors) const;

  WordId word_of(const Descriptor& descriptor) const;

  std::size_t words() const { return weights_.size(); }
  float weight(WordId word) const { return weights_[word]; }

  /// Hash of tree and weights; identifies the vocabulary.
  std::uint64_t fingerprint() const { return fingerprint_; }

  bool operator==(const Vocabulary&) const = default;

 private:
  struct Node {
    Descriptor median{};
    std::uint32_t first_child = 0;  // children are contiguous; a leaf has none
    std::uint32_t children = 0;
    WordId word = 0;  // of a leaf
    bool operator==(const Node&) const = default;
  };
  class Trainer;

  void number_words();
  void weigh(std::span<const std::vector<Descriptor>> images);

  std::vector<Node> nodes_;     // the root first, parents before children
  std::vector<float> weights_;  // by word
  std::uint64_t fingerprint_ = 0;
};

/// The vocabulary supplied with the program; empty if it is missing.
ROSLAM_EXPORT std::filesystem::path find_vocabulary();

/// The vocabulary of a file, or without a name the supplied one; null if that is missing. Throws InputError.
ROSLAM_EXPORT std::shared_ptr<const Vocabulary> open_vocabulary(const std::filesystem::path& file = {});

}  // namespace roslam
