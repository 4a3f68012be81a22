// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/timestamp.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::size_t kDecimals = 9;
}  // namespace

double seconds_of(std::int64_t nanoseconds) {
  std::array<char, 48> text{};
  const bool is_negative = nanoseconds < 0;
  const std::uint64_t size =
      is_negative ? 0 - static_cast<std::uint64_t>(nanoseconds) : static_cast<std::uint64_t>(nanoseconds);
  const int length = std::snprintf(text.data(), text.size(), "%s%llu.%09llu", is_negative ? "-" : "",
                                   static_cast<unsigned long long>(size / kSecond),
                                   static_cast<unsigned long long>(size % kSecond));
  double seconds = 0.0;
  std::from_chars(text.data(), text.data() + length, seconds);
  return seconds;
}

std::int64_t nanoseconds_of(double seconds) {
  constexpr double kMost = 9.2e9;  // seconds
  if (!(std::abs(seconds) < kMost))
    throw InputError("a time stamp that cannot be: " + std::to_string(seconds) + " s");
  const double whole = std::floor(std::abs(seconds));
  std::array<char, 400> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), std::abs(seconds), std::chars_format::fixed);
  const std::string_view digits(text.data(), static_cast<std::size_t>(end.ptr - text.data()));
  const std::size_t point = digits.find('.');
  std::string decimals(point == std::string_view::npos ? std::string_view() : digits.substr(point + 1));
  const bool rounds_up = decimals.size() > kDecimals && decimals[kDecimals] >= '5';
  decimals.resize(kDecimals, '0');
  std::int64_t below = 0;
  std::from_chars(decimals.data(), decimals.data() + decimals.size(), below);
  const std::int64_t size = static_cast<std::int64_t>(whole) * kSecond + below + (rounds_up ? 1 : 0);
  return std::signbit(seconds) ? -size : size;
}

}  // namespace roslam
