// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace roslam {

/// Events by what they are, in words.
using Counts = std::map<std::string, std::size_t>;

/// Adds a number of events, if there are any.
inline void count(Counts& counts, const std::string& reason, std::size_t number) {
  if (number > 0) counts[reason] += number;
}

/// The events of both.
inline Counts sum(Counts counts, const Counts& others) {
  for (const auto& [reason, number] : others) counts[reason] += number;
  return counts;
}

}  // namespace roslam
