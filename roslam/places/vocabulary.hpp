// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "roslam/features/descriptor.hpp"

namespace roslam {

using WordId = std::uint32_t;

/// The words of a picture with their weights, by ascending word. Weights are positive and sum to 1; a picture
/// without descriptors has no words.
using BagOfWords = std::vector<std::pair<WordId, float>>;

/// How alike two pictures are, 0 to 1: one minus half the L1 distance of their bags (Galvez-Lopez and Tardos,
/// T-RO 2012, eq. 2).
double similarity(const BagOfWords& a, const BagOfWords& b);

struct VocabularyOptions {
  int branching = 10;      ///< children of a node
  int depth = 5;           ///< levels below the root; at most branching^depth words
  int iterations = 12;     ///< of k-medians for a node, at most
  std::uint64_t seed = 1;  ///< of the first medians

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A tree that sorts binary descriptors into words, so that pictures of one place have words in common
/// (Nister and Stewenius, CVPR 2006; Galvez-Lopez and Tardos, T-RO 2012). Never changes once it is made.
class Vocabulary {
 public:
  /// Hierarchical k-medians of all descriptors of all pictures. A word weighs the more the fewer pictures
  /// have it: log(pictures / pictures with it). progress, if given, is told the share that is done, 0 to 1.
  /// The same pictures in the same order and the same options make the same vocabulary. Throws OptionsError,
  /// or InputError if there are fewer descriptors than a node has children.
  static Vocabulary train(std::span<const std::vector<Descriptor>> pictures, const VocabularyOptions& options,
                          const std::function<void(double)>& progress = {});

  /// Throws InputError naming the file and what is wrong with it.
  static Vocabulary load(const std::filesystem::path& file);

  /// The content of such a file, behind its header, and back; name: of the file, for messages.
  std::string content() const;
  static Vocabulary decode(std::string_view content, const std::string& name);

  /// Replaces the file whole or not at all. Throws OutputError.
  void save(const std::filesystem::path& file) const;

  /// The words of a picture, weighed by how often they occur in it and how rare they are (tf-idf).
  BagOfWords describe(std::span<const Descriptor> descriptors) const;

  WordId word_of(const Descriptor& descriptor) const;

  std::size_t words() const { return weights_.size(); }
  float weight(WordId word) const { return weights_[word]; }

  /// Tells vocabularies apart: equal for equal trees and weights.
  std::uint64_t fingerprint() const { return fingerprint_; }

  bool operator==(const Vocabulary&) const = default;

 private:
  struct Node {
    Descriptor median{};
    std::uint32_t first_child = 0;  // children lie side by side; a leaf has none
    std::uint32_t children = 0;
    WordId word = 0;  // of a leaf
    bool operator==(const Node&) const = default;
  };
  class Trainer;

  void number_words();
  void weigh(std::span<const std::vector<Descriptor>> pictures);

  std::vector<Node> nodes_;     // the root first, parents before children
  std::vector<float> weights_;  // by word
  std::uint64_t fingerprint_ = 0;
};

/// The vocabulary that comes with the program; empty if it is not there.
std::filesystem::path shipped_vocabulary();

}  // namespace roslam
