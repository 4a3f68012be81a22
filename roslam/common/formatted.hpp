// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace roslam {

/// Numbers in words, as std::printf() writes them; at most 400 characters.
template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 401> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace roslam
