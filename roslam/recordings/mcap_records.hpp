// SPDX-License-Identifier: BSD-3-Clause
// Records of MCAP files: an operation (8 bits), a size (64 bits), the content.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "roslam/recordings/recording_file.hpp"

namespace roslam::mcap {

constexpr std::size_t kMagic = 8;
constexpr std::size_t kHead = 1 + 8;  // operation and size of a record
constexpr std::size_t kFooter = kHead + 8 + 8 + 4;

enum Operation : std::uint8_t {
  kHeader = 0x01,
  kFooterRecord = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kDataEnd = 0x0f
};

// Times are unsigned in the file; those that do not fit are none.
inline std::optional<std::int64_t> signed_time(std::uint64_t time) {
  if (time > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
  return static_cast<std::int64_t>(time);
}

struct Record {
  std::uint8_t operation = 0;
  ByteSpan content;
};

inline std::optional<Record> take_record(ByteCursor& cursor) {
  Record record;
  record.operation = cursor.get<std::uint8_t>();
  record.content = cursor.take(cursor.get<std::uint64_t>());
  return cursor.ok() ? std::optional(record) : std::nullopt;
}

}  // namespace roslam::mcap
