// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace roslam::evaluation {

/// Points hashed into voxels, for nearest-neighbour search within a radius.
class PointGrid {
 public:
  struct Found {
    std::size_t index = 0;
    float distance = 0.0F;  ///< metres
  };

  /// reach: metres, above 0, search radius of nearest().
  PointGrid(std::vector<Eigen::Vector3f> points, float reach);

  /// nullopt if there is no point within the reach.
  std::optional<Found> nearest(const Eigen::Vector3f& point) const;

 private:
  using Key = std::uint64_t;
  static Key key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kMask = (std::int64_t{1} << 21) - 1;
    return static_cast<Key>((x & kMask) << 42 | (y & kMask) << 21 | (z & kMask));
  }
  std::int64_t cell(float value) const { return static_cast<std::int64_t>(std::floor(value / reach_)); }

  std::vector<Eigen::Vector3f> points_;  // sorted by cell
  std::vector<std::size_t> order_;       // index of each as given
  float reach_;
  std::unordered_map<Key, std::pair<std::uint32_t, std::uint32_t>> cells_;  // first and end in points_
};

}  // namespace roslam::evaluation
