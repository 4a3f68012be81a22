// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/lowering.hpp"

#include <algorithm>
#include <utility>

#include "roslam/inference/plan/limits.hpp"

namespace roslam {

Lowering::Shape Lowering::shape_of(const OnnxNode& node) const {
  const OnnxArray* weights = node.inputs.size() < 2 ? nullptr : graph_.array(node.inputs[1]);
  if (weights == nullptr || weights->shape.size() != 4 || weights->values.empty())
    refuse_layer(node, "has no constant weights of four dimensions");
  const auto& dims = weights->shape;
  if (*std::max_element(dims.begin(), dims.end()) > kMaxChannels) refuse_layer(node, "has absurd weights");
  Shape shape{static_cast<int>(dims[0]), static_cast<int>(dims[1]), static_cast<int>(dims[2]), 1, 1, 0, 1};
  const auto same = [&](const char* name, std::int64_t otherwise, std::size_t count) {
    const auto values = node.attribute(name, std::vector<std::int64_t>(count, otherwise));
    const bool is_one = values.size() == count &&
                        std::all_of(values.begin(), values.end(), [&](auto v) { return v == values[0]; });
    if (!is_one || values[0] < 0 || values[0] > 64)
      refuse_layer(node, std::string("has ") + name + " that differ or are too large");
    return static_cast<int>(values[0]);
  };
  shape.stride = same("strides", 1, 2);
  shape.dilation = same("dilations", 1, 2);
  shape.padding = same("pads", 0, 4);
  shape.groups = static_cast<int>(std::clamp<std::int64_t>(node.attribute("group", {1})[0], 0, kMaxChannels));
  const bool is_known = dims[2] == dims[3] && (shape.kernel == 1 || shape.kernel == 3) &&
                        node.text("auto_pad", "NOTSET") == "NOTSET" &&
                        (shape.stride == 1 || shape.stride == 2) && shape.dilation >= 1 &&
                        shape.padding == shape.dilation * (shape.kernel / 2);
  if (!is_known) refuse_layer(node, "is not a square convolution of 1 or 3 pixels that keeps the size");
  return shape;
}

std::vector<float> Lowering::bias_of(const OnnxNode& node, int outputs) const {
  std::vector<float> bias = numbers(node, 2);
  if (bias.empty()) bias.assign(static_cast<std::size_t>(outputs), 0.0F);
  if (bias.size() != static_cast<std::size_t>(outputs))
    refuse_layer(node, "has a bias of another size than its outputs");
  return bias;
}

void Lowering::lower_convolution(const OnnxNode& node) {
  const Shape shape = shape_of(node);
  LoweredValue& in = value(node, 0);
  if (in.channels != shape.inputs * shape.groups)
    refuse_layer(node, "has weights for another number of channels");
  if (shape.groups > 1) return lower_depthwise(node, shape);
  PlannedStep step;
  step.kind = shape.outputs == 1 && shape.kernel == 3 ? StepKind::kSingleConvolution : StepKind::kConvolution;
  step.kernel = shape.kernel;
  step.stride = shape.stride;
  step.padding = shape.padding;
  step.dilation = shape.dilation;
  step.weights = graph_.array(node.inputs[1])->values;
  step.bias = bias_of(node, shape.outputs);
  const bool is_single_pixel = in.is_single_pixel;
  if (in.depthwise && shape.kernel == 1 && shape.stride == 1 && is_used_once(node.inputs[0])) {
    step.depthwise = std::move(in.depthwise);
    step.input = in.tensor;
  } else {
    step.input = tensor_of(node, 0);
    need_border(step.input, shape.padding);
  }
  set_step(node, std::move(step), shape.outputs, is_single_pixel);
}

void Lowering::lower_depthwise(const OnnxNode& node, const Shape& shape) {
  if (shape.inputs != 1 || shape.outputs != shape.groups || shape.kernel != 3 || shape.dilation != 1)
    refuse_layer(node, "has groups, but is not a depthwise convolution of 3x3");
  LoweredValue made;
  made.channels = shape.outputs;
  made.tensor = tensor_of(node, 0);
  need_border(made.tensor, 1);
  made.depthwise =
      DepthwiseWeights{shape.stride, graph_.array(node.inputs[1])->values, bias_of(node, shape.outputs)};
  set(node, std::move(made));
}

void Lowering::lower_transposed(const OnnxNode& node) {
  const OnnxArray* weights = node.inputs.size() < 2 ? nullptr : graph_.array(node.inputs[1]);
  const bool is_known = weights != nullptr && weights->shape.size() == 4 && !weights->values.empty() &&
                        weights->shape[2] == 2 && weights->shape[3] == 2 &&
                        weights->shape[1] <= kMaxChannels / 4 &&
                        node.attribute("strides", {1, 1}) == std::vector<std::int64_t>{2, 2} &&
                        node.attribute("pads", {0, 0, 0, 0}) == std::vector<std::int64_t>(4, 0) &&
                        node.attribute("group", {1})[0] == 1 && node.integers.count("output_padding") == 0;
  if (!is_known || node.outputs.empty() || node.outputs[0] != graph_.output)
    refuse_layer(node, "is not a transposed convolution of 2x2 at stride 2 at the end of the network");
  const int inputs = value(node, 0).channels;
  const int outputs = static_cast<int>(weights->shape[1]);
  if (weights->shape[0] != inputs) refuse_layer(node, "has weights for another number of channels");
  const std::vector<float> bias = bias_of(node, outputs);
  const int lanes = (outputs + 3) / 4 * 4;
  PlannedStep step;
  step.weights.assign(static_cast<std::size_t>(4 * lanes * inputs), 0.0F);
  step.bias.assign(static_cast<std::size_t>(4 * lanes), kLowestScore);
  for (int corner = 0; corner < 4; ++corner) {
    for (int o = 0; o < outputs; ++o) {
      const int row = corner * lanes + o;
      step.bias[static_cast<std::size_t>(row)] = bias[static_cast<std::size_t>(o)];
      for (int i = 0; i < inputs; ++i)
        step.weights[static_cast<std::size_t>(row * inputs + i)] =
            weights->values[static_cast<std::size_t>((i * outputs + o) * 4 + corner)];
    }
  }
  step.input = tensor_of(node, 0);
  set_step(node, std::move(step), 4 * lanes);
  plan_.output = tensor_of(node, node.outputs[0]);
  plan_.output_channels = outputs;
  plan_.sub_pixels = 2;
  plan_.lanes = lanes;
}

}  // namespace roslam
