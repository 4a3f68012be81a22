// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/descriptor.hpp"

#include <algorithm>

#include "roslam/common/target_clones.hpp"

namespace roslam {

namespace {
// Always inlined, so that it is compiled for the instruction set of each clone it is used in.
[[gnu::always_inline]] inline int distance(const Descriptor& a, const Descriptor& b) {
  return __builtin_popcountll(a[0] ^ b[0]) + __builtin_popcountll(a[1] ^ b[1]) +
         __builtin_popcountll(a[2] ^ b[2]) + __builtin_popcountll(a[3] ^ b[3]);
}

[[gnu::always_inline]] inline void offer(NearestTwo& nearest, int index, int candidate_distance) {
  if (candidate_distance < nearest.best_distance) {
    nearest.second = nearest.best;
    nearest.second_distance = nearest.best_distance;
    nearest.best = index;
    nearest.best_distance = candidate_distance;
  } else if (candidate_distance < nearest.second_distance) {
    nearest.second = index;
    nearest.second_distance = candidate_distance;
  }
}

ROSLAM_TARGET_CLONES("popcnt") int hamming_clone(const Descriptor& a, const Descriptor& b) {
  return distance(a, b);
}

ROSLAM_TARGET_CLONES("popcnt")
void search_candidates(const Descriptor& query, const Descriptor* pool, const std::uint32_t* candidates,
                       std::size_t count, NearestTwo& nearest) {
  for (std::size_t i = 0; i < count; ++i) {
    offer(nearest, static_cast<int>(candidates[i]), distance(query, pool[candidates[i]]));
  }
}

ROSLAM_TARGET_CLONES("popcnt")
void search_all(const Descriptor& query, const Descriptor* pool, std::size_t count, NearestTwo& nearest) {
  for (std::size_t i = 0; i < count; ++i) offer(nearest, static_cast<int>(i), distance(query, pool[i]));
}
}  // namespace

int hamming(const Descriptor& a, const Descriptor& b) { return hamming_clone(a, b); }

NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> pool,
                       std::span<const std::uint32_t> candidates) {
  NearestTwo nearest;
  search_candidates(query, pool.data(), candidates.data(), candidates.size(), nearest);
  return nearest;
}

NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> pool) {
  NearestTwo nearest;
  search_all(query, pool.data(), pool.size(), nearest);
  return nearest;
}

std::size_t most_typical(std::span<const Descriptor> pool) {
  std::size_t best = 0;
  int best_median = kDescriptorBits + 1;
  std::vector<int> distances(pool.size());
  for (std::size_t i = 0; i < pool.size(); ++i) {
    for (std::size_t j = 0; j < pool.size(); ++j) distances[j] = hamming(pool[i], pool[j]);
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((pool.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return best;
}

}  // namespace roslam
