// SPDX-License-Identifier: BSD-3-Clause
// Writes small ONNX files, of networks that are right, wrong or hostile.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace roslam {

class OnnxWriter {
 public:
  using Integers = std::vector<std::pair<std::string, std::vector<std::int64_t>>>;

  OnnxWriter& array(const std::string& name, const std::vector<std::int64_t>& shape,
                    const std::vector<float>& values) {
    std::string raw(values.size() * sizeof(float), '\0');
    if (!raw.empty()) std::memcpy(raw.data(), values.data(), raw.size());
    std::string tensor;
    for (const std::int64_t side : shape) tensor += number(1, side);
    graph_ += bytes(5, tensor + number(2, 1) + bytes(8, name) + bytes(9, raw));
    return *this;
  }

  OnnxWriter& node(const std::string& type, const std::vector<std::string>& inputs, const std::string& output,
                   const Integers& attributes = {}, const std::string& text_name = {},
                   const std::string& text = {}) {
    std::string message;
    for (const std::string& input : inputs) message += bytes(1, input);
    message += bytes(2, output) + bytes(3, std::string("the_").append(output)) + bytes(4, type);
    for (const auto& [name, values] : attributes) {
      std::string attribute = bytes(1, name);
      for (const std::int64_t value : values) attribute += number(values.size() == 1 ? 3 : 8, value);
      message += bytes(5, attribute);
    }
    if (!text_name.empty()) message += bytes(5, bytes(1, text_name) + bytes(4, text));
    graph_ += bytes(1, message);
    return *this;
  }

  std::string file(const std::string& input, std::int64_t channels, const std::string& output) const {
    std::string shape;
    for (const std::int64_t side : {std::int64_t{1}, channels, std::int64_t{64}, std::int64_t{64}})
      shape += bytes(1, number(1, side));
    const std::string type = bytes(2, bytes(1, number(1, 1) + bytes(2, shape)));
    const std::string graph =
        graph_ + bytes(2, "graph") + bytes(11, bytes(1, input) + type) + bytes(12, bytes(1, output) + type);
    return number(1, 6) + bytes(8, number(2, 11)) + bytes(7, graph);
  }

 private:
  static std::string varint(std::uint64_t value) {
    std::string out;
    for (; value >= 128; value >>= 7U) out += static_cast<char>((value & 127U) | 128U);
    out += static_cast<char>(value);
    return out;
  }
  static std::string number(std::uint64_t field, std::int64_t value) {
    std::string message = varint(field << 3U);
    message.append(varint(static_cast<std::uint64_t>(value)));
    return message;
  }
  static std::string bytes(std::uint64_t field, const std::string& content) {
    std::string message = varint(field << 3U | 2U);
    message.append(varint(content.size())).append(content);
    return message;
  }

  std::string graph_;
};

}  // namespace roslam
