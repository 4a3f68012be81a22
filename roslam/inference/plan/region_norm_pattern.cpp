// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/region_norm_pattern.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "roslam/inference/plan/limits.hpp"

namespace roslam {

namespace {
using Pair = std::pair<std::string, std::string>;

// Matches one region normalisation backwards from its last node. Notation of
// training/restoration/networks.py: share = mean(region) + tiny, m = mean(x region) / share, variance =
// relu(mean(x x region) / share - m m), gain = scale / sqrt(variance + epsilon); result = x sum(gain region)
// + sum((shift - m gain) region).
class Matcher {
 public:
  explicit Matcher(const OnnxGraph& graph) : graph_(graph) {
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      for (const std::string& output : graph.nodes[i].outputs) producers_[output] = i;
    }
  }

  std::optional<RegionNormMatch> match(const OnnxNode& last) {
    if (last.type != "Add" || last.inputs.size() != 2) return std::nullopt;
    for (const auto& [product, addend] : orders({last.inputs[0], last.inputs[1]})) {
      const auto factors = operands(product, "Mul");
      if (!factors) continue;
      for (const auto& [x, factor] : orders(*factors)) {
        nodes_.clear();
        note(product);
        RegionNormMatch result;
        result.input = x;
        if (match_regions(factor, addend, result)) {
          result.nodes = nodes_;
          return result;
        }
      }
    }
    return std::nullopt;
  }

 private:
  static std::vector<Pair> orders(const Pair& pair) { return {pair, {pair.second, pair.first}}; }

  const OnnxNode* producer(const std::string& value, const char* type) const {
    const auto found = producers_.find(value);
    if (found == producers_.end() || graph_.nodes[found->second].type != type) return nullptr;
    return &graph_.nodes[found->second];
  }

  void note(const std::string& value) { nodes_.insert(producers_.at(value)); }

  std::optional<Pair> operands(const std::string& value, const char* type) const {
    const OnnxNode* node = producer(value, type);
    if (node == nullptr || node->inputs.size() != 2) return std::nullopt;
    return Pair{node->inputs[0], node->inputs[1]};
  }

  // The input of a node of that type with one input that counts, which becomes part of the match.
  std::optional<std::string> through(const std::string& value, const char* type) {
    const OnnxNode* node = producer(value, type);
    if (node == nullptr || node->inputs.empty()) return std::nullopt;
    note(value);
    return node->inputs[0];
  }

  // Null also for a constant of a type whose numbers are not read.
  const OnnxArray* array(const std::string& value) const {
    const OnnxArray* found = graph_.array(value);
    return found == nullptr || found->values.empty() ? nullptr : found;
  }

  // The other operand of a commutative node one of whose operands is an array.
  std::optional<std::pair<std::string, const OnnxArray*>> with_array(const std::string& value,
                                                                     const char* type) {
    const auto pair = operands(value, type);
    if (!pair) return std::nullopt;
    for (const auto& [other, constant] : orders(*pair)) {
      if (const OnnxArray* found = array(constant); found != nullptr && array(other) == nullptr) {
        note(value);
        return std::pair(other, found);
      }
    }
    return std::nullopt;
  }

  bool is_product(const std::string& value, const std::string& a, const std::string& b) {
    const auto pair = operands(value, "Mul");
    if (!pair || (*pair != Pair{a, b} && *pair != Pair{b, a})) return false;
    note(value);
    return true;
  }

  // The terms of a sum of sums; the depth is limited, as a foreign graph may nest without end.
  std::vector<std::string> terms(const std::string& value, int depth = kMaxRegions) {
    const auto pair = operands(value, "Add");
    if (!pair || depth == 0) return {value};
    note(value);
    std::vector<std::string> all = terms(pair->first, depth - 1);
    const auto more = terms(pair->second, depth - 1);
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  // The value whose mean over the image this is.
  std::optional<std::string> mean_of(const std::string& value) {
    auto inner = through(value, "GlobalAveragePool");
    if (!inner) return std::nullopt;
    if (const auto pooled = through(*inner, "AveragePool")) {  // means of blocks first
      inner = pooled;
      if (const auto padded = through(*inner, "Pad")) inner = padded;
    }
    return inner;
  }

  bool is_mean_of_product(const std::string& value, const std::string& a, const std::string& b) {
    const auto inner = mean_of(value);
    return inner && is_product(*inner, a, b);
  }

  bool is_share(const std::string& value, const std::string& spread) {
    const auto sum = with_array(value, "Add");
    if (!sum || !sum->second->is_scalar()) return false;
    const auto inner = mean_of(sum->first);
    return inner && *inner == spread;
  }

  // mean(x region) / share
  bool is_region_mean(const std::string& value, const std::string& x, const std::string& spread) {
    const auto pair = operands(value, "Div");
    if (!pair || !is_mean_of_product(pair->first, x, spread) || !is_share(pair->second, spread)) return false;
    note(value);
    return true;
  }

  struct Gain {
    std::string mean;
    const OnnxArray* scale;
    float epsilon;
  };

  std::optional<Gain> match_gain(const std::string& value, const std::string& x, const std::string& spread) {
    const auto scaled = with_array(value, "Mul");
    if (!scaled) return std::nullopt;
    const auto root = through(scaled->first, "Reciprocal");
    const auto sum = root ? through(*root, "Sqrt") : std::nullopt;
    const auto with_epsilon = sum ? with_array(*sum, "Add") : std::nullopt;
    if (!with_epsilon || !with_epsilon->second->is_scalar()) return std::nullopt;
    const auto difference = through(with_epsilon->first, "Relu");
    const auto moments = difference ? operands(*difference, "Sub") : std::nullopt;
    if (!moments) return std::nullopt;
    note(*difference);
    const auto square = operands(moments->second, "Mul");  // m m
    if (!square || square->first != square->second || !is_region_mean(square->first, x, spread))
      return std::nullopt;
    note(moments->second);
    const auto second = operands(moments->first, "Div");  // mean(x x region) / share
    if (!second || !is_share(second->second, spread)) return std::nullopt;
    note(moments->first);
    const auto inner = mean_of(second->first);
    const auto product = inner ? operands(*inner, "Mul") : std::nullopt;
    if (!product) return std::nullopt;
    note(*inner);
    for (const auto& [squares, region] : orders(*product)) {
      if (region == spread && is_product(squares, x, x))
        return Gain{square->first, scaled->second, with_epsilon->second->values[0]};
    }
    return std::nullopt;
  }

  // shift + m gain (-1)
  const OnnxArray* match_shift(const std::string& value, const std::string& mean, const std::string& gain) {
    const auto sum = with_array(value, "Add");
    const auto negated = sum ? with_array(sum->first, "Mul") : std::nullopt;
    if (!negated || !negated->second->is_scalar() || negated->second->values[0] != -1.0F) return nullptr;
    return is_product(negated->first, mean, gain) ? sum->second : nullptr;
  }

  // The map of one channel that a convolution with ones copies to all channels.
  std::optional<std::string> share_of(const std::string& spread) {
    const OnnxNode* node = producer(spread, "Conv");
    if (node == nullptr || node->inputs.size() != 2) return std::nullopt;
    const OnnxArray* ones = array(node->inputs[1]);
    if (ones == nullptr || ones->shape.size() != 4 || ones->shape[1] != 1 || ones->shape[2] != 1 ||
        ones->shape[3] != 1)
      return std::nullopt;
    if (!std::all_of(ones->values.begin(), ones->values.end(), [](float v) { return v == 1.0F; }))
      return std::nullopt;
    note(spread);
    return node->inputs[0];
  }

  bool match_regions(const std::string& factor, const std::string& addend, RegionNormMatch& result) {
    const auto gains = terms(factor);
    const auto shifts = terms(addend);
    if (gains.size() != shifts.size() || gains.size() > static_cast<std::size_t>(kMaxRegions)) return false;
    for (std::size_t r = 0; r < gains.size(); ++r) {
      const auto gain_pair = operands(gains[r], "Mul");
      const auto shift_pair = operands(shifts[r], "Mul");
      if (!gain_pair || !shift_pair || gain_pair->second != shift_pair->second) return false;
      note(gains[r]);
      note(shifts[r]);
      const std::string& spread = gain_pair->second;
      const auto share = share_of(spread);
      const auto gain = share ? match_gain(gain_pair->first, result.input, spread) : std::nullopt;
      const OnnxArray* shift = gain ? match_shift(shift_pair->first, gain->mean, gain_pair->first) : nullptr;
      if (shift == nullptr || (r > 0 && gain->epsilon != result.epsilon)) return false;
      result.epsilon = gain->epsilon;
      result.regions.push_back({*share, gain->scale->values, shift->values});
    }
    return true;
  }

  const OnnxGraph& graph_;
  std::map<std::string, std::size_t> producers_;
  std::set<std::size_t> nodes_;
};
}  // namespace

std::map<std::size_t, RegionNormMatch> find_region_norms(const OnnxGraph& graph) {
  std::map<std::size_t, RegionNormMatch> found;
  Matcher matcher(graph);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (auto match = matcher.match(graph.nodes[i])) found.emplace(i, std::move(*match));
  }
  return found;
}

}  // namespace roslam
