// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace roslam {

/// An array of numbers stored in an ONNX file; integers are converted.
struct OnnxArray {
  std::vector<std::int64_t> shape;
  std::vector<float> values;

  bool is_scalar() const { return values.size() == 1; }
};

struct OnnxNode {
  std::string type;  ///< operator, such as Conv
  std::string name;
  std::vector<std::string> inputs;  ///< names of values; empty: an optional input that is left out
  std::vector<std::string> outputs;
  std::map<std::string, std::vector<std::int64_t>>
      integers;                              ///< attributes that are integers or lists of them
  std::map<std::string, std::string> texts;  ///< attributes that are strings

  /// Type and name, for messages.
  std::string title() const { return type + (name.empty() ? std::string() : " " + name); }

  /// The attribute that is a string, or the one given where the node has none.
  std::string text(const std::string& attribute_name, const std::string& otherwise) const;

  /// The attribute, or the values given where the node has none.
  std::vector<std::int64_t> attribute(const std::string& attribute_name,
                                      std::vector<std::int64_t> otherwise) const;
};

/// The computation of an ONNX file with one input and one output, without what only describes it.
struct OnnxGraph {
  std::vector<OnnxNode> nodes;              ///< in the order of computation
  std::map<std::string, OnnxArray> arrays;  ///< weights and constants, by name of the value
  std::string input;
  std::string output;
  std::int64_t input_channels = 0;  ///< 0 if the file does not say

  /// The constant of that name; null if the value is none.
  const OnnxArray* array(const std::string& value) const;
};

/// Reads an ONNX file (Protocol Buffers; onnx.ai, file format IR version 3 and later). Throws ModelError,
/// without the name of the file, if it is damaged or holds what OnnxGraph cannot.
OnnxGraph read_onnx(const std::string& bytes);

}  // namespace roslam
