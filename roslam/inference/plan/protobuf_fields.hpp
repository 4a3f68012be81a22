// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace roslam {

/// A field of a Protocol Buffers message (protobuf.dev/programming-guides/encoding): where its content lies.
struct ProtobufField {
  std::uint64_t number;
  std::size_t start;   ///< of the tag
  std::size_t begin;   ///< of the content
  std::size_t end;     ///< of the content
  unsigned wire_type;  ///< 0 varint, 1 eight bytes, 2 bytes with a length, 5 four bytes
};

/// Reads a variable-length integer and moves position behind it; nothing if it does not end before end.
inline std::optional<std::uint64_t> read_varint(const std::string& bytes, std::size_t& position,
                                                std::size_t end) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64 && position < end; shift += 7) {
    const auto byte = static_cast<std::uint8_t>(bytes[position++]);
    value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) return value;
  }
  return std::nullopt;
}

/// The fields of a message and whether it is whole.
struct ProtobufMessage {
  std::vector<ProtobufField> fields;
  bool is_whole = true;  ///< false: damaged after the last field
};

/// The fields of the message in begin..end of the bytes; those read so far if it is damaged.
inline ProtobufMessage read_message(const std::string& bytes, std::size_t begin, std::size_t end) {
  ProtobufMessage message;
  std::size_t position = begin;
  const auto damaged = [&] {
    message.is_whole = false;
    return message;
  };
  while (position < end) {
    const std::size_t start = position;
    const auto tag = read_varint(bytes, position, end);
    if (!tag) return damaged();
    std::size_t content = position;
    std::uint64_t length = 0;
    switch (*tag & 7U) {
      case 0:
        if (!read_varint(bytes, position, end)) return damaged();
        break;
      case 1:
        length = 8;
        break;
      case 2: {
        const auto stated = read_varint(bytes, position, end);
        if (!stated) return damaged();
        content = position;
        length = *stated;
        break;
      }
      case 5:
        length = 4;
        break;
      default:
        return damaged();
    }
    if (length > end - position) return damaged();
    position += static_cast<std::size_t>(length);
    message.fields.push_back({*tag >> 3U, start, content, position, static_cast<unsigned>(*tag & 7U)});
  }
  return message;
}

}  // namespace roslam
