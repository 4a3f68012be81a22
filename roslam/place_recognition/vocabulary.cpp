// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/vocabulary.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/binary.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/resources.hpp"

namespace roslam {

namespace {
constexpr BinaryFormat kFormat{"ROSLAMVO", 1, "a vocabulary", 64 * 1024 * 1024};
constexpr std::size_t kNodeBytes = sizeof(Descriptor) + 8;

std::uint64_t fnv(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3ULL;
  return hash;
}
}  // namespace

std::filesystem::path find_vocabulary() { return find_resource("roslam-orb.vocabulary"); }

std::shared_ptr<const Vocabulary> open_vocabulary(const std::filesystem::path& file) {
  const std::filesystem::path path = file.empty() ? find_vocabulary() : file;
  return path.empty() ? nullptr : std::make_shared<const Vocabulary>(Vocabulary::load(path));
}

double similarity(const BagOfWords& a, const BagOfWords& b) {
  // For weights that sum to 1, one minus half the L1 distance is the sum of the lesser weight of each word.
  double shared = 0.0;
  auto in_a = a.begin();
  auto in_b = b.begin();
  while (in_a != a.end() && in_b != b.end()) {
    if (in_a->first == in_b->first) {
      shared += std::min(in_a->second, in_b->second);
      ++in_a;
      ++in_b;
    } else if (in_a->first < in_b->first) {
      ++in_a;
    } else {
      ++in_b;
    }
  }
  return shared;
}

void VocabularyOptions::validate() const {
  if (branching < 2 || branching > 64) throw OptionsError("vocabulary.branching must be 2 to 64");
  if (depth < 1 || depth > 8) throw OptionsError("vocabulary.depth must be 1 to 8");
  if (std::pow(branching, depth) > 1.1e6) {
    throw OptionsError("vocabulary.branching and depth make more than a million words; lower one of them");
  }
  if (iterations < 1) throw OptionsError("vocabulary.iterations must be at least 1");
}

WordId Vocabulary::word_of(const Descriptor& descriptor) const {
  const Node* node = nodes_.data();
  while (node->children > 0) {
    const Node* best = nullptr;
    int least = kDescriptorBits + 1;
    for (std::uint32_t i = 0; i < node->children; ++i) {
      const Node& child = nodes_[node->first_child + i];
      const int distance = hamming(descriptor, child.median);
      if (distance >= least) continue;
      least = distance;
      best = &child;
    }
    node = best;
  }
  return node->word;
}

BagOfWords Vocabulary::describe(std::span<const Descriptor> descriptors) const {
  std::vector<WordId> found;
  found.reserve(descriptors.size());
  for (const auto& descriptor : descriptors) found.push_back(word_of(descriptor));
  std::sort(found.begin(), found.end());
  BagOfWords bag;
  double sum = 0.0;
  for (const WordId word : found) {
    if (bag.empty() || bag.back().first != word) bag.emplace_back(word, 0.0F);
    bag.back().second += weights_[word];
    sum += static_cast<double>(weights_[word]);
  }
  // Words found in every training image have weight 0 and carry no information.
  std::erase_if(bag, [](const auto& entry) { return entry.second <= 0.0F; });
  for (auto& [word, weight] : bag) weight = static_cast<float>(static_cast<double>(weight) / sum);
  return bag;
}

void Vocabulary::number_words() {
  WordId next = 0;
  for (auto& node : nodes_) {
    if (node.children == 0) node.word = next++;
  }
  weights_.assign(next, 0.0F);
}

void Vocabulary::weigh(std::span<const std::vector<Descriptor>> images) {
  std::vector<std::size_t> images_with(weights_.size(), 0);
  std::vector<std::size_t> last(weights_.size(), images.size());
  for (std::size_t p = 0; p < images.size(); ++p) {
    for (const auto& descriptor : images[p]) {
      const WordId word = word_of(descriptor);
      if (last[word] == p) continue;
      last[word] = p;
      ++images_with[word];
    }
  }
  const auto all = static_cast<double>(images.size());
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    weights_[w] =
        static_cast<float>(std::log(all / static_cast<double>(std::max<std::size_t>(images_with[w], 1))));
  }
  fingerprint_ = fnv(content());
}

std::string Vocabulary::content() const {
  BinaryWriter writer;
  writer.put(static_cast<std::uint32_t>(nodes_.size()));
  // Children are stored in the order of their parents, so that their number alone determines their position.
  for (const auto& node : nodes_) {
    for (const std::uint64_t part : node.median) writer.put(part);
    writer.put(node.children);
    writer.put(node.children > 0 ? 0.0F : weights_[node.word]);
  }
  return writer.bytes();
}

void Vocabulary::save(const std::filesystem::path& file) const { write_binary(file, kFormat, content()); }

Vocabulary Vocabulary::load(const std::filesystem::path& file) {
  return decode(read_binary(file, kFormat), file.string());
}

Vocabulary Vocabulary::decode(std::string_view content, const std::string& name) {
  BinaryReader reader(content, name);
  Vocabulary result;
  result.nodes_.resize(reader.get_count(kNodeBytes));
  std::uint32_t next = 1;
  for (std::size_t i = 0; i < result.nodes_.size(); ++i) {
    Node& node = result.nodes_[i];
    for (std::uint64_t& part : node.median) part = reader.get<std::uint64_t>();
    node.children = reader.get<std::uint32_t>();
    const auto weight = reader.get<float>();
    if (i >= next || node.children > result.nodes_.size() - next) reader.fail("its tree is inconsistent");
    if (!(weight >= 0.0F && weight < 100.0F)) reader.fail("it has a word with an invalid weight");
    if (node.children > 0) {
      node.first_child = next;
      next += node.children;
      continue;
    }
    node.word = static_cast<WordId>(result.weights_.size());
    result.weights_.push_back(weight);
  }
  if (next != result.nodes_.size() || reader.left() > 0) reader.fail("its tree is inconsistent");
  result.fingerprint_ = fnv(content);
  return result;
}

}  // namespace roslam
