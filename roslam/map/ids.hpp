// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>

namespace roslam {

/// A number that names an element of a map; ids are given out in order and never reused.
template <typename Tag>
struct Id {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t value = kNone;

  bool is_valid() const { return value != kNone; }
  std::size_t index() const { return value; }
  auto operator<=>(const Id&) const = default;
};

using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;

/// A part of a map that is tied to no other: where the parts lie to each other is not known (yet).
using WorldId = Id<struct WorldTag>;

}  // namespace roslam
