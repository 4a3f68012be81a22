// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {

/// Writes the fields of a ROS 2 message in their order, in the OMG Common Data Representation, version 1,
/// little-endian: the inverse of RosReader.
class RosWriter {
 public:
  RosWriter() : bytes_{0, 1, 0, 0} {}

  template <typename T>
  void put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    align(sizeof(T));
    append(&value, sizeof(T));
  }

  void text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    append(text.data(), text.size());
    bytes_.push_back(0);
  }

  /// An array of bytes, after its length.
  void bytes(std::span<const std::uint8_t> bytes) {
    put(static_cast<std::uint32_t>(bytes.size()));
    raw(bytes);
  }

  /// The length of an array whose elements follow.
  void count(std::size_t elements) { put(static_cast<std::uint32_t>(elements)); }

  /// Bytes of an array of bytes whose count() was written.
  void raw(std::span<const std::uint8_t> bytes) { append(bytes.data(), bytes.size()); }

  /// Numbers of an array of fixed length.
  template <typename Numbers>
  void numbers(const Numbers& values) {
    for (const double value : values) put(value);
  }

  /// stamp: nanoseconds. Throws InputError for one beyond 68 years from zero.
  void header(std::int64_t stamp, std::string_view frame) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    std::int64_t seconds = stamp / kSecond;
    if (stamp % kSecond < 0) --seconds;
    if (static_cast<std::int32_t>(seconds) != seconds)
      throw InputError("a time stamp that a ROS 2 message cannot hold: " + std::to_string(seconds) + " s");
    put(static_cast<std::int32_t>(seconds));
    put(static_cast<std::uint32_t>(stamp - seconds * kSecond));
    text(frame);
  }

  /// Makes room for so many bytes more.
  void reserve(std::size_t bytes) { bytes_.reserve(bytes_.size() + bytes); }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void append(const void* data, std::size_t size) {
    if (size == 0) return;
    const std::size_t at = bytes_.size();
    bytes_.resize(at + size);
    std::memcpy(bytes_.data() + at, data, size);
  }

  static constexpr std::size_t kEncapsulation = 4;

  void align(std::size_t size) {
    while ((bytes_.size() - kEncapsulation) % size != 0) bytes_.push_back(0);
  }

  std::vector<std::uint8_t> bytes_;
};

}  // namespace roslam
