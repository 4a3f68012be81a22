// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>

#include "roslam/common/export.hpp"

namespace roslam {

/// Identifies an element of a map; ids are assigned in ascending order and never reused.
template <typename Tag>
struct ROSLAM_EXPORT Id {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t value = kNone;

  bool is_valid() const { return value != kNone; }
  std::size_t index() const { return value; }
  auto operator<=>(const Id&) const = default;
};

using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;

/// A connected component of a map. The relative pose of different submaps is unknown.
using SubmapId = Id<struct SubmapTag>;

}  // namespace roslam
