// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "roslam/sensors/counts.hpp"

namespace roslam {

/// Counts colour images without a depth image, and how far in time the nearest is from them.
class MissingDepth {
 public:
  /// nearest: nanoseconds from the colour image; nothing if there is none. most: up to which it would have
  /// been taken, unless it belongs to another colour image.
  void add(std::optional<std::int64_t> nearest, std::int64_t most);

  /// Adds what was counted, in words.
  void add_to(Counts& skipped) const;

 private:
  std::size_t without_ = 0;                           // no depth image, or one that belongs to another
  std::size_t distant_ = 0;                           // one that is too far
  std::int64_t least_ = 0, farthest_ = 0, most_ = 0;  // nanoseconds, of the latter
};

}  // namespace roslam
