// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {

/// How the fields of a message are laid out. kCdr: OMG Common Data Representation, version 1 (ROS 2).
enum class RosEncoding { kRos1, kCdr };

/// Reads the fields of a ROS message in their order. ROS 1 packs them without padding; CDR aligns each to its
/// size, counted from behind the four bytes of its header, and ends strings with a zero byte. Little-endian.
/// Throws InputError if the message ends too early or is of another version of CDR.
class RosReader {
 public:
  RosReader(std::span<const std::uint8_t> message, RosEncoding encoding)
      : bytes_(message), encoding_(encoding) {
    if (encoding != RosEncoding::kCdr) return;
    const std::span<const std::uint8_t> header = take(kCdrHeader);
    if (header[0] != 0 || header[1] != 1)
      throw InputError("message in a CDR other than little-endian version 1");
  }

  RosEncoding encoding() const { return encoding_; }

  template <typename T>
  T get() {
    static_assert(std::is_arithmetic_v<T>);
    align(sizeof(T));
    T value{};
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }

  std::string text() {
    const auto bytes = take(get<std::uint32_t>());
    const std::string_view view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const bool has_end = encoding_ == RosEncoding::kCdr && view.ends_with('\0');
    return std::string(has_end ? view.substr(0, view.size() - 1) : view);
  }

  /// An array of bytes whose length precedes it; of the message itself.
  std::span<const std::uint8_t> bytes() { return take(get<std::uint32_t>()); }

  /// An array of numbers of fixed length.
  template <std::size_t N>
  void get(std::array<double, N>& values) {
    for (double& value : values) value = get<double>();
  }

  /// How many elements follow, each of at least that many bytes.
  std::size_t count(std::size_t least_bytes) {
    const auto elements = get<std::uint32_t>();
    if (elements > (bytes_.size() - at_) / least_bytes) throw InputError("message is truncated");
    return elements;
  }

  std::vector<double> numbers() {
    std::vector<double> values(count(sizeof(double)));
    for (double& value : values) value = get<double>();
    return values;
  }

  /// A time (seconds and nanoseconds), in nanoseconds.
  std::int64_t time() {
    const std::int64_t seconds = encoding_ == RosEncoding::kCdr ? std::int64_t{get<std::int32_t>()}
                                                                : std::int64_t{get<std::uint32_t>()};
    return seconds * 1000000000 + get<std::uint32_t>();
  }

 private:
  static constexpr std::size_t kCdrHeader = 4;

  void align(std::size_t size) {
    if (encoding_ != RosEncoding::kCdr) return;
    const std::size_t past = (at_ - kCdrHeader) % size;
    if (past > 0) take(size - past);
  }

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > bytes_.size() - at_) throw InputError("message is truncated");
    const auto taken = bytes_.subspan(at_, count);
    at_ += count;
    return taken;
  }

  std::span<const std::uint8_t> bytes_;
  RosEncoding encoding_;
  std::size_t at_ = 0;
};

}  // namespace roslam
