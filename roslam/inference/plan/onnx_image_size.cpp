// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/onnx_image_size.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "roslam/inference/plan/protobuf_fields.hpp"

namespace roslam {

namespace {
// Replaces dim_value (tag, two-byte varint) by a one-letter dim_param (tag, length, letter). Both take three
// bytes, so that nothing has to be moved.
void open_dimension(std::string& bytes, const ProtobufField& value, char name) {
  constexpr std::uint64_t kValue = 1;      // TensorShapeProto.Dimension.dim_value
  constexpr char kNameTag = (2 << 3) | 2;  // dim_param, a string
  if (value.number != kValue || value.end - value.start != 3) return;
  bytes[value.start] = kNameTag;
  bytes[value.start + 1] = 1;
  bytes[value.start + 2] = name;
}

// Follows a path of field numbers and calls found(field) for each field at its end.
template <typename Found>
void follow(const std::string& bytes, const ProtobufField& message, const std::vector<std::uint64_t>& path,
            std::size_t depth, const Found& found) {
  for (const ProtobufField& field : read_message(bytes, message.begin, message.end).fields) {
    if (field.number != path[depth]) continue;
    depth + 1 == path.size() ? found(field) : follow(bytes, field, path, depth + 1, found);
  }
}
}  // namespace

std::string with_open_image_size(std::string onnx) {
  // ModelProto.graph, GraphProto.input or output, ValueInfoProto.type, TypeProto.tensor_type, Tensor.shape
  for (const std::uint64_t end : {11U, 12U}) {
    follow(onnx, {0, 0, 0, onnx.size(), 2}, {7, end, 2, 1, 2}, 0, [&](const ProtobufField& shape) {
      const auto dimensions = read_message(onnx, shape.begin, shape.end).fields;
      if (dimensions.size() != 4) return;
      for (std::size_t i = 2; i < 4; ++i) {
        const auto values = read_message(onnx, dimensions[i].begin, dimensions[i].end).fields;
        if (values.size() != 1) continue;
        const char base = end == 11U ? 'h' : 'r';  // the output's names differ from the input's
        open_dimension(onnx, values.front(), static_cast<char>(base + static_cast<char>(i) - 2));
      }
    });
  }
  return onnx;
}

}  // namespace roslam
