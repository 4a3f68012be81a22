// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

#include "roslam/common/binary.hpp"

namespace roslam {

/// What the three writers have in common.
class RecordingWriter {
 public:
  virtual ~RecordingWriter() = default;

  /// Describes a topic; returns its id for write().
  virtual int add_topic(const std::string& name, const std::string& type, const std::string& definition) = 0;

  /// time: nanoseconds; in any order.
  virtual void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) = 0;

  /// Writes the index.
  virtual void close() = 0;
};

/// method: "none", "lz4", "bz2" or "zstd".
inline std::string compressed(const std::string& method, const std::string& bytes) {
  std::string packed;
  std::size_t size = 0;
  if (method == "lz4") {
    LZ4F_preferences_t preferences{};  // as ROS 1 needs them
    preferences.frameInfo.blockMode = LZ4F_blockIndependent;
    preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
    packed.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    size = LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
  } else if (method == "zstd") {
    packed.resize(ZSTD_compressBound(bytes.size()));
    size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1);
  } else if (method == "bz2") {
    packed.resize(bytes.size() + bytes.size() / 100 + 600);
    auto length = static_cast<unsigned>(packed.size());
    std::string source = bytes;
    if (BZ2_bzBuffToBuffCompress(packed.data(), &length, source.data(), static_cast<unsigned>(source.size()),
                                 1, 0, 0) != BZ_OK)
      throw std::runtime_error("bz2 failed");
    size = length;
  } else {
    return bytes;
  }
  packed.resize(size);
  return packed;
}

/// Bytes of a number, little-endian.
template <BinaryValue T>
std::string bits(T value) {
  BinaryWriter writer;
  writer.put(value);
  return writer.bytes();
}

struct ChunkOptions {
  std::string compression = "none";
  std::size_t chunk_bytes = 768 * 1024;  ///< of records, after which a chunk ends by itself
};

}  // namespace roslam
