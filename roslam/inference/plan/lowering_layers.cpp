// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/lowering.hpp"

#include <algorithm>
#include <utility>

namespace roslam {

void Lowering::lower_region_norm(const OnnxNode& node, const RegionNormMatch& norm) {
  PlannedStep step;
  step.kind = StepKind::kRegionNorm;
  step.input = tensor_of(node, norm.input);
  step.epsilon = norm.epsilon;
  const int channels = tensor(step.input).channels;
  if (norm.regions.size() < 2) refuse_layer(node, "normalises fewer than two regions");
  for (const auto& region : norm.regions) {
    const int share = tensor_of(node, region.share);
    if (tensor(share).channels != 1 || region.scale.size() != static_cast<std::size_t>(channels) ||
        region.shift.size() != static_cast<std::size_t>(channels))
      refuse_layer(node, "has regions of another size than the features");
    step.regions.push_back({share, region.scale, region.shift});
  }
  set_step(node, std::move(step), channels);
}

void Lowering::lower_relu(const OnnxNode& node) {
  LoweredValue& in = value(node, 0);
  const bool can_fold = in.step && !in.step->relu && is_used_once(node.inputs[0]) &&
                        (in.step->kind == StepKind::kConvolution || in.step->kind == StepKind::kBinary ||
                         in.step->kind == StepKind::kRegionNorm);
  if (can_fold) {
    LoweredValue made = std::move(in);
    made.step->relu = true;
    return set(node, std::move(made));
  }
  PlannedStep step;
  step.kind = StepKind::kBinary;
  step.input = tensor_of(node, 0);
  step.relu = true;
  set_step(node, std::move(step), value(node, 0).channels, value(node, 0).is_single_pixel);
}

bool Lowering::takes_residual(const OnnxNode& node, std::size_t input) {
  const LoweredValue& v = value(node, input);
  const LoweredValue& other = value(node, 1 - input);
  if (!v.step || v.step->second >= 0 || !is_used_once(node.inputs[input]) || v.channels != other.channels ||
      v.is_single_pixel || other.is_single_pixel)
    return false;
  if (v.step->kind == StepKind::kRegionNorm) return v.step->relu && other.upsampled < 0;
  return v.step->kind == StepKind::kConvolution && !v.step->relu;
}

void Lowering::lower_add(const OnnxNode& node) {
  if (node.inputs.size() != 2) refuse_layer(node, "does not have two inputs");
  if (graph_.array(node.inputs[0]) != nullptr || graph_.array(node.inputs[1]) != nullptr)
    return lower_binary(node);
  for (const std::size_t input : {1U, 0U}) {
    if (node.inputs[0] == node.inputs[1] || !takes_residual(node, input)) continue;
    const LoweredValue& other = value(node, 1 - input);
    const bool doubles = other.upsampled >= 0 && other.tensor < 0 && is_used_once(node.inputs[1 - input]);
    const int second = doubles ? other.upsampled : tensor_of(node, 1 - input);
    LoweredValue made = std::move(value(node, input));
    made.step->second = second;
    made.step->doubles_second = doubles;
    return set(node, std::move(made));
  }
  lower_binary(node);
}

void Lowering::lower_binary(const OnnxNode& node) {
  if (node.inputs.size() != 2) refuse_layer(node, "does not have two inputs");
  const OnnxArray* first = graph_.array(node.inputs[0]);
  const OnnxArray* second = graph_.array(node.inputs[1]);
  if (first != nullptr && second != nullptr) refuse_layer(node, "computes a constant");
  if (second != nullptr && value(node, 0).is_image && normalise_image(node, second->values)) return;
  PlannedStep step;
  step.kind = StepKind::kBinary;
  const std::size_t main = first == nullptr ? 0 : 1;
  step.input = tensor_of(node, main);
  int channels = tensor(step.input).channels;
  bool is_single_pixel = value(node, main).is_single_pixel;
  if (const OnnxArray* constant = first != nullptr ? first : second; constant != nullptr) {
    if (!constant->is_scalar()) refuse_layer(node, "has a constant operand that is not one number");
    step.number = constant->values[0];
  } else {
    step.second = tensor_of(node, 1);
    is_single_pixel = is_single_pixel && value(node, 1).is_single_pixel;
    const int other = tensor(step.second).channels;
    // A larger operand comes first.
    if (node.type != "Sub" && (other > channels || value(node, 0).is_single_pixel))
      std::swap(step.input, step.second);
    channels = std::max(channels, other);
    if (tensor(step.input).channels != channels ||
        (other != channels && std::min(other, tensor(step.second).channels) != 1))
      refuse_layer(node, "has operands of different channels");
  }
  if (node.type == "Add") {
    step.operation = BinaryOperation::kAdd;
  } else if (node.type == "Mul") {
    step.operation = BinaryOperation::kMultiply;
  } else if (node.type == "Sub") {
    step.operation = main == 0 ? BinaryOperation::kSubtract : BinaryOperation::kSubtractFrom;
  } else {
    refuse_layer(node, "divides by what is not a constant of the input");
  }
  set_step(node, std::move(step), channels, is_single_pixel);
}

bool Lowering::normalise_image(const OnnxNode& node, const std::vector<float>& constant) {
  LoweredValue in = value(node, 0);
  const auto channels = static_cast<std::size_t>(in.channels);
  if ((constant.size() != channels && constant.size() != 1) || !is_used_once(node.inputs[0])) return false;
  std::vector<float> each = constant;
  each.resize(channels, constant[0]);
  if (node.type == "Sub" && plan_.mean.empty() && plan_.deviation.empty()) {
    plan_.mean = each;
  } else if (node.type == "Div" && plan_.deviation.empty()) {
    plan_.deviation = each;
  } else {
    return false;
  }
  set(node, std::move(in));
  return true;
}

void Lowering::lower_sigmoid(const OnnxNode& node) {
  PlannedStep step;
  step.kind = StepKind::kSigmoid;
  step.input = tensor_of(node, 0);
  set_step(node, std::move(step), tensor(step.input).channels);
}

void Lowering::lower_pad(const OnnxNode& node) {
  std::vector<float> pads = numbers(node, 1);
  const std::vector<float> fill = numbers(node, 2);
  const bool is_known = pads.size() == 8 && pads[0] == 0.0F && pads[1] == 0.0F && pads[4] == 0.0F &&
                        pads[5] == 0.0F && pads[3] == pads[2] && pads[6] == pads[2] && pads[7] == pads[2] &&
                        pads[2] >= 0.0F && pads[2] <= 64.0F && node.text("mode", "constant") == "constant" &&
                        (fill.empty() || fill[0] == 0.0F);
  if (!is_known) refuse_layer(node, "is not an equal padding with zeros on all sides");
  const int same = tensor_of(node, 0);
  LoweredValue made = value(node, 0);
  made.tensor = same;
  made.padding = static_cast<int>(pads[2]);
  need_border(same, made.padding);
  set(node, std::move(made));
}

void Lowering::lower_pool(const OnnxNode& node) {
  const auto kernel = node.attribute("kernel_shape", {});
  const auto strides = node.attribute("strides", {1, 1});
  const bool is_known = kernel.size() == 2 && kernel[0] == kernel[1] && kernel[0] >= 1 && kernel[0] <= 64 &&
                        strides.size() == 2 && strides[0] == strides[1] && strides[0] >= 1 &&
                        strides[0] <= 64 &&
                        node.attribute("pads", {0, 0, 0, 0}) == std::vector<std::int64_t>(4, 0) &&
                        node.attribute("ceil_mode", {0})[0] == 0 && node.texts.count("auto_pad") == 0;
  if (!is_known) refuse_layer(node, "is not a square pool without padding of its own");
  PlannedStep step;
  step.kind = node.type == "MaxPool" ? StepKind::kMaxPool : StepKind::kAveragePool;
  step.kernel = static_cast<int>(kernel[0]);
  step.stride = static_cast<int>(strides[0]);
  LoweredValue& in = value(node, 0);
  step.padding = std::exchange(in.padding, 0);
  step.input = tensor_of(node, 0);
  in.padding = step.padding;
  if (step.padding > 0 && step.kind == StepKind::kMaxPool) refuse_layer(node, "is a maximum over padding");
  set_step(node, std::move(step), in.channels);
}

void Lowering::lower_global_pool(const OnnxNode& node) {
  PlannedStep step;
  step.kind = StepKind::kGlobalAverage;
  step.input = tensor_of(node, 0);
  set_step(node, std::move(step), tensor(step.input).channels, true);
}

void Lowering::lower_resize(const OnnxNode& node) {
  const bool is_known = numbers(node, 2) == std::vector<float>{1.0F, 1.0F, 2.0F, 2.0F} &&
                        node.inputs.size() == 3 && node.text("mode", "nearest") == "linear" &&
                        node.text("coordinate_transformation_mode", "half_pixel") == "half_pixel";
  if (!is_known) refuse_layer(node, "does not double the size bilinearly");
  LoweredValue made;
  made.channels = value(node, 0).channels;
  made.upsampled = tensor_of(node, 0);
  set(node, std::move(made));
}

void Lowering::lower_concat(const OnnxNode& node) {
  if (node.attribute("axis", {1})[0] != 1 || node.inputs.empty())
    refuse_layer(node, "does not join channels");
  int channels = 0;
  for (std::size_t i = 0; i < node.inputs.size(); ++i) channels += value(node, i).channels;
  if (channels > kMaxChannels) refuse_layer(node, "has an absurd number of channels");
  const int whole = add_tensor(channels);
  int offset = 0;
  std::set<int> joined;
  for (std::size_t i = 0; i < node.inputs.size(); ++i) {
    int part = tensor_of(node, i);
    if (part == 0 || tensor(part).parent >= 0 || !joined.insert(part).second) {
      PlannedStep copy;
      copy.kind = StepKind::kCopy;
      copy.layer = node.title();
      copy.input = part;
      copy.output = part = add_tensor(tensor(part).channels);
      plan_.steps.push_back(std::move(copy));
    }
    tensor(part).parent = whole;
    tensor(part).offset = offset;
    need_border(part, tensor(part).border);
    offset += tensor(part).channels;
  }
  LoweredValue made;
  made.channels = channels;
  made.tensor = whole;
  set(node, std::move(made));
}

void Lowering::lower_slice(const OnnxNode& node) {
  const auto starts = numbers(node, 1);
  const auto ends = numbers(node, 2);
  const auto axes = numbers(node, 3);
  const auto steps = numbers(node, 4);
  if (starts.size() != 1 || ends.size() != 1 || axes != std::vector<float>{1.0F} ||
      (!steps.empty() && steps != std::vector<float>{1.0F}))
    refuse_layer(node, "does not take a range of channels");
  const int of = tensor_of(node, 0);
  const float channels = static_cast<float>(tensor(of).channels);
  if (!(starts[0] >= 0.0F && ends[0] > starts[0] && starts[0] < channels))
    refuse_layer(node, "takes channels that there are not");
  const int begin = static_cast<int>(starts[0]);
  LoweredValue made;
  made.channels = static_cast<int>(std::min(ends[0], channels)) - begin;
  made.tensor = add_tensor(made.channels);
  tensor(made.tensor).parent = of;
  tensor(made.tensor).offset = begin;
  set(node, std::move(made));
}

void Lowering::lower_depth_to_space(const OnnxNode& node) {
  const int channels = value(node, 0).channels;
  if (node.attribute("blocksize", {0})[0] != 2 || node.text("mode", "DCR") != "CRD" || channels % 4 != 0)
    refuse_layer(node, "is not a rearrangement of four channels to 2x2 pixels in the order CRD");
  PlannedStep step;
  step.kind = StepKind::kDepthToSpace;
  step.input = tensor_of(node, 0);
  set_step(node, std::move(step), channels / 4);
}

}  // namespace roslam
