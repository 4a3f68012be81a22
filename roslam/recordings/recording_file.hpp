// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/binary.hpp"
#include "roslam/common/file_descriptor.hpp"

namespace roslam {

using ByteSpan = std::span<const std::uint8_t>;

/// The most bytes that are read or unpacked at once; a chunk or message that claims more is left out.
constexpr std::size_t kMaxChunkBytes = std::size_t{256} << 20;

inline std::string_view as_text(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Bytes whose memory is not initialised, so that pages that are never written do not take any.
class ByteBuffer {
 public:
  ByteBuffer() = default;
  explicit ByteBuffer(std::size_t size)
      : bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(size)), size_(size) {}

  std::uint8_t* data() { return bytes_.get(); }
  std::size_t size() const { return size_; }
  ByteSpan span() const { return {bytes_.get(), size_}; }
  /// Keeps the first bytes. size: at most size().
  void shorten(std::size_t size) { size_ = size; }

 private:
  std::unique_ptr<std::uint8_t[]> bytes_;
  std::size_t size_ = 0;
};

/// Reads little-endian values one after another. Beyond the end it gives zeros and is no longer ok(), so that
/// the caller checks once. Unlike BinaryReader it costs nothing to make, one for each message.
class ByteCursor {
 public:
  explicit ByteCursor(ByteSpan bytes) : bytes_(bytes) {}

  template <BinaryValue T>
  T get() {
    static_assert(std::endian::native == std::endian::little);
    T value{};
    const ByteSpan bytes = take(sizeof value);
    if (ok_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  ByteSpan take(std::uint64_t count) {
    if (!ok_ || count > bytes_.size() - at_) {
      ok_ = false;
      return {};
    }
    const ByteSpan result = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += result.size();
    return result;
  }

  /// A length (32 bits), then the bytes.
  std::string_view text() { return as_text(take(get<std::uint32_t>())); }

  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }
  bool ok() const { return ok_; }

 private:
  ByteSpan bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// A file that is read at any place. Small reads near each other are served from a window of it.
class RecordingFile {
 public:
  /// Throws InputError if the file is missing or cannot be read.
  explicit RecordingFile(const std::filesystem::path& path);

  /// Bytes of the file, valid until the next call; fewer at its end. count: at most kWindow. Throws
  /// InputError.
  ByteSpan view(std::uint64_t offset, std::size_t count);

  /// Fills a buffer with bytes of the file, which must lie within it. Throws InputError.
  void read(std::uint64_t offset, std::span<std::uint8_t> into) const;
  ByteBuffer read(std::uint64_t offset, std::size_t count) const;

  std::uint64_t size() const { return size_; }
  const std::string& name() const { return name_; }

  static constexpr std::size_t kWindow = std::size_t{64} << 10;

 private:
  std::string name_;
  FileDescriptor descriptor_;
  std::uint64_t size_ = 0;
  std::vector<std::uint8_t> window_;
  std::uint64_t window_begin_ = 0;
};

}  // namespace roslam
