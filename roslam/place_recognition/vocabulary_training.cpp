// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/place_recognition/vocabulary.hpp"

namespace roslam {

namespace {
using Medians = std::vector<Descriptor>;

std::size_t nearest(const Medians& medians, const Descriptor& descriptor) {
  return static_cast<std::size_t>(nearest_two(descriptor, medians).best);
}

// Median of binary descriptors, the one with the least sum of Hamming distances: the majority of each bit.
class MedianSum {
 public:
  void add(const Descriptor& descriptor) {
    ++count_;
    for (std::size_t bit = 0; bit < ones_.size(); ++bit) {
      ones_[bit] += static_cast<std::uint32_t>((descriptor[bit / 64] >> (bit % 64)) & 1U);
    }
  }

  bool is_empty() const { return count_ == 0; }

  Descriptor median() const {
    Descriptor result{};
    for (std::size_t bit = 0; bit < ones_.size(); ++bit) {
      if (2 * ones_[bit] > count_) result[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
    return result;
  }

 private:
  std::array<std::uint32_t, kDescriptorBits> ones_{};
  std::uint32_t count_ = 0;
};
}  // namespace

class Vocabulary::Trainer {
 public:
  Trainer(std::span<const std::vector<Descriptor>> images, const VocabularyOptions& options)
      : options_(options), random_(options.seed) {
    for (const auto& image : images) descriptors_.insert(descriptors_.end(), image.begin(), image.end());
  }

  std::vector<Node> tree(const std::function<void(double)>& progress) {
    if (descriptors_.size() < static_cast<std::size_t>(options_.branching)) {
      throw InputError("too few corners in the images to train a vocabulary (" +
                       std::to_string(descriptors_.size()) +
                       "); give more images, or ones with more texture");
    }
    std::vector<Node> nodes(1);
    std::vector<Branch> branches{{0, descriptors_.size(), 0}};  // of each node
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Branch branch = branches[i];
      if (branch.level >= options_.depth) continue;
      const Medians medians = split(branch);
      if (!medians.empty()) {
        nodes[i].first_child = static_cast<std::uint32_t>(nodes.size());
        nodes[i].children = static_cast<std::uint32_t>(medians.size());
        add_children(branch, medians, nodes, branches);
      }
      const double of_level = static_cast<double>(branch.end) / static_cast<double>(descriptors_.size());
      if (progress) progress((branch.level + of_level) / options_.depth);
    }
    return nodes;
  }

 private:
  // The descriptors below a node, a range of descriptors_.
  struct Branch {
    std::size_t begin = 0;
    std::size_t end = 0;
    int level = 0;
  };

  std::span<Descriptor> below(const Branch& branch) {
    return std::span(descriptors_).subspan(branch.begin, branch.end - branch.begin);
  }

  // k-medians of the descriptors below a node; none if it cannot be split.
  Medians split(const Branch& branch) {
    const std::span<const Descriptor> members = below(branch);
    if (members.size() < 2) return {};
    Medians medians = first_medians(members);
    if (medians.size() < 2) return {};
    std::vector<std::size_t> cluster(members.size(), medians.size());
    for (int i = 0; i < options_.iterations; ++i) {
      bool is_settled = true;
      std::vector<MedianSum> sums(medians.size());
      for (std::size_t m = 0; m < members.size(); ++m) {
        const std::size_t best = nearest(medians, members[m]);
        is_settled = is_settled && best == cluster[m];
        cluster[m] = best;
        sums[best].add(members[m]);
      }
      if (is_settled) break;
      for (std::size_t c = 0; c < medians.size(); ++c) {
        if (!sums[c].is_empty()) medians[c] = sums[c].median();
      }
    }
    return medians;
  }

  // k-means++ (Arthur and Vassilvitskii, SODA 2007): each next median is drawn with probability proportional
  // to the squared distance to the nearest one so far. Fewer if the members have too few distinct values.
  Medians first_medians(std::span<const Descriptor> members) {
    Medians medians{members[draw(members.size())]};
    std::vector<std::uint64_t> squares(members.size(), std::uint64_t{1} << 32);
    while (medians.size() < static_cast<std::size_t>(options_.branching)) {
      std::uint64_t sum = 0;
      for (std::size_t m = 0; m < members.size(); ++m) {
        const auto distance = static_cast<std::uint64_t>(hamming(members[m], medians.back()));
        squares[m] = std::min(squares[m], distance * distance);
        sum += squares[m];
      }
      if (sum == 0) break;
      std::uint64_t left = draw(sum);
      std::size_t chosen = 0;
      while (left >= squares[chosen]) left -= squares[chosen++];
      medians.push_back(members[chosen]);
    }
    return medians;
  }

  // Sorts the members of a node by child and appends the children.
  void add_children(const Branch& branch, const Medians& medians, std::vector<Node>& nodes,
                    std::vector<Branch>& branches) {
    std::vector<std::vector<Descriptor>> members(medians.size());
    for (const auto& descriptor : below(branch)) members[nearest(medians, descriptor)].push_back(descriptor);
    std::size_t begin = branch.begin;
    for (std::size_t c = 0; c < medians.size(); ++c) {
      std::copy(members[c].begin(), members[c].end(),
                descriptors_.begin() + static_cast<std::ptrdiff_t>(begin));
      nodes.push_back({medians[c]});
      branches.push_back({begin, begin + members[c].size(), branch.level + 1});
      begin += members[c].size();
    }
  }

  // Uniform in [0, below). The distributions of the standard differ between libraries.
  std::uint64_t draw(std::uint64_t below) { return random_() % below; }

  VocabularyOptions options_;
  std::mt19937_64 random_;
  std::vector<Descriptor> descriptors_;
};

Vocabulary Vocabulary::train(std::span<const std::vector<Descriptor>> images,
                             const VocabularyOptions& options, const std::function<void(double)>& progress) {
  options.validate();
  Vocabulary result;
  result.nodes_ = Trainer(images, options).tree(progress);
  result.number_words();
  result.weigh(images);
  return result;
}

}  // namespace roslam
