// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/onnx_image_size.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace roslam {

namespace {
// A field of a Protocol Buffers message (protobuf.dev/programming-guides/encoding): where its content lies.
struct Field {
  std::uint64_t number;
  std::size_t start;  // of the tag
  std::size_t begin;  // of the content
  std::size_t end;
};

std::optional<std::uint64_t> read_varint(const std::string& bytes, std::size_t& position, std::size_t end) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64 && position < end; shift += 7) {
    const auto byte = static_cast<std::uint8_t>(bytes[position++]);
    value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) return value;
  }
  return std::nullopt;
}

// The fields of the message in begin..end; those read so far if it is damaged.
std::vector<Field> fields_in(const std::string& bytes, std::size_t begin, std::size_t end) {
  std::vector<Field> fields;
  std::size_t position = begin;
  while (position < end) {
    const std::size_t start = position;
    const auto tag = read_varint(bytes, position, end);
    if (!tag) break;
    std::size_t content = position;
    switch (*tag & 7U) {
      case 0:
        if (!read_varint(bytes, position, end)) return fields;
        break;
      case 1:
        position += 8;
        break;
      case 2: {
        const auto length = read_varint(bytes, position, end);
        if (!length || *length > end - position) return fields;
        content = position;
        position += static_cast<std::size_t>(*length);
        break;
      }
      case 5:
        position += 4;
        break;
      default:
        return fields;
    }
    if (position > end) break;
    fields.push_back({*tag >> 3U, start, content, position});
  }
  return fields;
}

// Replaces dim_value (tag, two-byte varint) by a one-letter dim_param (tag, length, letter). Both take three
// bytes, so that nothing has to be moved.
void open_dimension(std::string& bytes, const Field& value, char name) {
  constexpr std::uint64_t kValue = 1;      // TensorShapeProto.Dimension.dim_value
  constexpr char kNameTag = (2 << 3) | 2;  // dim_param, a string
  if (value.number != kValue || value.end - value.start != 3) return;
  bytes[value.start] = kNameTag;
  bytes[value.start + 1] = 1;
  bytes[value.start + 2] = name;
}

// Follows a path of field numbers and calls found(field) for each field at its end.
template <typename Found>
void follow(const std::string& bytes, const Field& message, const std::vector<std::uint64_t>& path,
            std::size_t depth, const Found& found) {
  for (const Field& field : fields_in(bytes, message.begin, message.end)) {
    if (field.number != path[depth]) continue;
    depth + 1 == path.size() ? found(field) : follow(bytes, field, path, depth + 1, found);
  }
}
}  // namespace

std::string with_open_image_size(std::string onnx) {
  // ModelProto.graph, GraphProto.input or output, ValueInfoProto.type, TypeProto.tensor_type, Tensor.shape
  for (const std::uint64_t end : {11U, 12U}) {
    follow(onnx, {0, 0, 0, onnx.size()}, {7, end, 2, 1, 2}, 0, [&](const Field& shape) {
      const auto dimensions = fields_in(onnx, shape.begin, shape.end);
      if (dimensions.size() != 4) return;
      for (std::size_t i = 2; i < 4; ++i) {
        const auto values = fields_in(onnx, dimensions[i].begin, dimensions[i].end);
        if (values.size() != 1) continue;
        const char base = end == 11U ? 'h' : 'r';  // the output's names differ from the input's
        open_dimension(onnx, values.front(), static_cast<char>(base + static_cast<char>(i) - 2));
      }
    });
  }
  return onnx;
}

}  // namespace roslam
