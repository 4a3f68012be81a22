// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/onnx_graph.hpp"

#include <cstring>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/inference/plan/protobuf_fields.hpp"

namespace roslam {

namespace {
enum class DataType : std::uint64_t { kFloat = 1, kInt64 = 7 };  // TensorProto.DataType

// A message within the bytes of the file.
class Message {
 public:
  Message(const std::string& bytes, std::size_t begin, std::size_t end) : bytes_(bytes) {
    ProtobufMessage message = read_message(bytes, begin, end);
    if (!message.is_whole) throw ModelError("is damaged");
    fields_ = std::move(message.fields);
  }

  std::vector<ProtobufField> all(std::uint64_t number) const {
    std::vector<ProtobufField> found;
    for (const ProtobufField& field : fields_) {
      if (field.number == number) found.push_back(field);
    }
    return found;
  }

  std::vector<Message> messages(std::uint64_t number) const {
    std::vector<Message> found;
    for (const ProtobufField& field : all(number)) {
      if (field.wire_type != 2) throw ModelError("is damaged");
      found.emplace_back(bytes_, field.begin, field.end);
    }
    return found;
  }

  std::vector<std::string> texts(std::uint64_t number) const {
    std::vector<std::string> found;
    for (const ProtobufField& field : all(number)) found.push_back(content(field));
    return found;
  }

  std::string text(std::uint64_t number) const {
    const auto found = texts(number);
    return found.empty() ? std::string() : found.back();
  }

  // Integers, packed or one by one.
  std::vector<std::int64_t> integers(std::uint64_t number) const {
    std::vector<std::int64_t> values;
    for (const ProtobufField& field : all(number)) {
      std::size_t position = field.begin;
      while (position < field.end) {
        const auto value = read_varint(bytes_, position, field.end);
        if (!value) throw ModelError("is damaged");
        values.push_back(static_cast<std::int64_t>(*value));
      }
    }
    return values;
  }

  std::int64_t integer(std::uint64_t number) const {
    const auto values = integers(number);
    return values.empty() ? 0 : values.back();
  }

  std::string content(const ProtobufField& field) const {
    return bytes_.substr(field.begin, field.end - field.begin);
  }

 private:
  const std::string& bytes_;
  std::vector<ProtobufField> fields_;
};

template <typename Number>
std::vector<float> converted(const std::string& raw) {
  if (raw.size() % sizeof(Number) != 0) throw ModelError("is damaged");
  std::vector<float> values(raw.size() / sizeof(Number));
  for (std::size_t i = 0; i < values.size(); ++i) {
    Number number;
    std::memcpy(&number, raw.data() + i * sizeof(Number), sizeof(Number));
    values[i] = static_cast<float>(number);
  }
  return values;
}

// TensorProto: dims 1, data_type 2, float_data 4, int64_data 7, name 8, raw_data 9, data_location 14.
OnnxArray read_array(const Message& tensor) {
  OnnxArray array;
  std::uint64_t count = 1;
  for (const std::int64_t side : tensor.integers(1)) {
    if (side < 0 || (side > 0 && count > (1ULL << 30U) / static_cast<std::uint64_t>(side)))
      throw ModelError("holds an array of absurd size");
    count *= static_cast<std::uint64_t>(side);
    array.shape.push_back(side);
  }
  const auto type = static_cast<DataType>(tensor.integer(2));
  const std::string raw = tensor.text(9);
  if (type == DataType::kFloat) {
    std::string bytes = raw;
    for (const ProtobufField& field : tensor.all(4)) bytes += tensor.content(field);
    array.values = converted<float>(bytes);
  } else if (type == DataType::kInt64) {
    array.values = converted<std::int64_t>(raw);
    for (const std::int64_t value : tensor.integers(7)) array.values.push_back(static_cast<float>(value));
  }  // other types stay without values, which no layer can use
  if (!array.values.empty() && array.values.size() != count) throw ModelError("is damaged");
  return array;
}

// NodeProto: input 1, output 2, name 3, op_type 4, attribute 5. AttributeProto: name 1, i 3, s 4, t 5,
// ints 8.
void read_node(const Message& message, OnnxGraph& graph) {
  OnnxNode node{message.text(4), message.text(3), message.texts(1), message.texts(2), {}, {}};
  for (const Message& attribute : message.messages(5)) {
    const std::string name = attribute.text(1);
    std::vector<std::int64_t> values = attribute.integers(8);
    if (values.empty()) values = attribute.integers(3);
    if (!values.empty()) node.integers[name] = std::move(values);
    if (const std::string text = attribute.text(4); !text.empty()) node.texts[name] = text;
    const auto tensors = attribute.messages(5);
    if (node.type == "Constant" && name == "value" && !tensors.empty() && node.outputs.size() == 1)
      graph.arrays[node.outputs.front()] = read_array(tensors.front());
  }
  if (node.type != "Constant") graph.nodes.push_back(std::move(node));
}

// ValueInfoProto: name 1, type 2; TypeProto: tensor_type 1; Tensor: shape 2; Shape: dim 1; Dimension:
// value 1.
std::int64_t channels_of(const Message& value) {
  for (const Message& type : value.messages(2)) {
    for (const Message& tensor : type.messages(1)) {
      for (const Message& shape : tensor.messages(2)) {
        const auto dimensions = shape.messages(1);
        if (dimensions.size() == 4) return dimensions[1].integer(1);
      }
    }
  }
  return 0;
}
}  // namespace

std::vector<std::int64_t> OnnxNode::attribute(const std::string& attribute_name,
                                              std::vector<std::int64_t> otherwise) const {
  const auto found = integers.find(attribute_name);
  return found == integers.end() ? std::move(otherwise) : found->second;
}

std::string OnnxNode::text(const std::string& attribute_name, const std::string& otherwise) const {
  const auto found = texts.find(attribute_name);
  return found == texts.end() ? otherwise : found->second;
}

const OnnxArray* OnnxGraph::array(const std::string& value) const {
  const auto found = arrays.find(value);
  return found == arrays.end() ? nullptr : &found->second;
}

OnnxGraph read_onnx(const std::string& bytes) {
  // ModelProto: graph 7. GraphProto: node 1, initializer 5, input 11, output 12.
  const auto graphs = Message(bytes, 0, bytes.size()).messages(7);
  if (graphs.size() != 1) throw ModelError("is damaged or not an ONNX file");
  const Message& source = graphs.front();
  OnnxGraph graph;
  for (const Message& tensor : source.messages(5)) graph.arrays[tensor.text(8)] = read_array(tensor);
  for (const Message& node : source.messages(1)) read_node(node, graph);
  std::vector<Message> inputs;
  for (Message& input : source.messages(11)) {  // old files list the weights as well
    if (graph.arrays.count(input.text(1)) == 0) inputs.push_back(std::move(input));
  }
  const auto outputs = source.messages(12);
  if (inputs.size() != 1 || outputs.size() != 1) throw ModelError("does not have one input and one output");
  graph.input = inputs.front().text(1);
  graph.input_channels = channels_of(inputs.front());
  graph.output = outputs.front().text(1);
  return graph;
}

}  // namespace roslam
