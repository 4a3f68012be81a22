// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace roslam {

/// Types of values in a binary file: numbers of a fixed size.
template <typename T>
concept BinaryValue = std::is_arithmetic_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, long double>;

/// Serialises values, little-endian and without padding.
class BinaryWriter {
 public:
  template <BinaryValue T>
  void put(T value) {
    static_assert(std::endian::native == std::endian::little);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  void put_bytes(std::string_view bytes) { bytes_.append(bytes); }

  /// A length (32 bits), then the bytes.
  void put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    put_bytes(text);
  }

  const std::string& bytes() const& { return bytes_; }
  std::string bytes() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads values in the order they were written. Throws InputError naming the file if it ends too early.
class BinaryReader {
 public:
  /// The bytes must outlive the reader. name: of the file, for messages.
  BinaryReader(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  template <BinaryValue T>
  T get() {
    T value{};
    const std::string_view bytes = get_bytes(sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  std::string_view get_bytes(std::size_t count);
  std::string_view get_text();

  /// A number of items (32 bits) of at least bytes_each bytes. Checked against the bytes left, so that a
  /// damaged count never leads to an allocation larger than the file.
  std::size_t get_count(std::size_t bytes_each);

  std::size_t left() const { return bytes_.size() - at_; }
  const std::string& name() const { return name_; }

  /// Throws InputError saying that the file is damaged and why.
  [[noreturn]] void fail(const std::string& why) const;

 private:
  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0;
};

/// Type and version of a file, its first 12 bytes, and its size limit.
struct BinaryFormat {
  std::string_view magic;        ///< 8 characters
  std::uint32_t version = 1;     ///< that is written
  std::string_view what;         ///< in words, "a vocabulary", for messages
  std::uintmax_t max_bytes = 0;  ///< larger files are refused unread
  std::uint32_t oldest = 0;      ///< version that is read; 0: only version
};

/// Writes magic, version, length of the content, its CRC-32 and the content. Atomic, by replace_file. Throws
/// OutputError.
void write_binary(const std::filesystem::path& file, const BinaryFormat& format, std::string_view content);

/// Reads such a file, checks its header and checksum and returns the content. Throws InputError naming what
/// is wrong and the remedy.
std::string read_binary(const std::filesystem::path& file, const BinaryFormat& format);

/// The same for bytes in memory; name: of the file, for messages.
std::string_view check_binary(std::string_view bytes, const BinaryFormat& format, const std::string& name);

}  // namespace roslam
