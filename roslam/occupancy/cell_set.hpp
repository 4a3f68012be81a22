// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "roslam/dense/voxel.hpp"

namespace roslam {

/// A bit for each cell of a cube of kBlockSide^3 cells, in Morton (octree) order, x fastest, then y: the
/// cells of an aligned smaller cube are contiguous.
class CellBlock {
 public:
  /// Returns false if the cell was marked before. Coordinates are relative to the corner of the block.
  bool mark(std::size_t x, std::size_t y, std::size_t z) {
    const std::size_t cell = index(x, y, z);
    std::uint64_t& word = words_[cell / 64];
    const std::uint64_t bit = std::uint64_t{1} << cell % 64;
    const bool is_new = (word & bit) == 0;
    word |= bit;
    return is_new;
  }

  /// Number of marked cells in the aligned cube with that corner and side (1, 2, 4 or 8 cells).
  int count(std::size_t x, std::size_t y, std::size_t z, std::size_t side) const {
    const std::size_t first = index(x, y, z);
    int sum = 0;
    if (side >= 4) {
      for (std::size_t word = first / 64; word < (first + side * side * side) / 64; ++word)
        sum += std::popcount(words_[word]);
      return sum;
    }
    const std::uint64_t some = side == 2 ? 0xff : 1;
    return std::popcount(words_[first / 64] >> first % 64 & some);
  }

  void erase(const CellBlock& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= ~other.words_[i];
  }

 private:
  static std::size_t index(std::size_t x, std::size_t y, std::size_t z) {
    constexpr std::array<std::size_t, kBlockSide> kSpread{0, 1, 8, 9, 64, 65, 72, 73};  // bits spread by 3
    return kSpread[x] | kSpread[y] << 1 | kSpread[z] << 2;
  }

  std::array<std::uint64_t, 8> words_{};
};

/// A sparse set of cells, in blocks. A cell's coordinates are in units of its side, from the world origin.
using CellSet = std::unordered_map<BlockKey, CellBlock, BlockKeyHash>;

/// The block that contains a cell.
inline BlockKey block_of(const Eigen::Vector3i& cell) {
  static_assert(kBlockSide == 8);
  return {cell.x() >> 3, cell.y() >> 3, cell.z() >> 3};
}

/// Marks a cell in its block. Returns false if it was marked before.
inline bool mark(CellBlock& block, const Eigen::Vector3i& cell) {
  const auto within = [](int coordinate) { return static_cast<std::size_t>(coordinate & (kBlockSide - 1)); };
  return block.mark(within(cell.x()), within(cell.y()), within(cell.z()));
}

}  // namespace roslam
