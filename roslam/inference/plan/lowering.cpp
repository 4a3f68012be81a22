// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/plan/lowering.hpp"

#include <algorithm>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMaxLayers = 4096;
}  // namespace

void refuse_layer(const OnnxNode& node, const std::string& why) {
  throw ModelError("layer " + node.title() + ": " + why);
}

Lowering::Lowering(const OnnxGraph& graph) : graph_(graph) {
  check_order();
  count_uses();
  norms_ = find_region_norms(graph);
  for (const auto& [last, norm] : norms_) absorbed_.insert(norm.nodes.begin(), norm.nodes.end());
}

NetworkPlan Lowering::run() {
  LoweredValue image;
  image.channels = input_channels();
  image.is_image = true;
  image.tensor = add_tensor(image.channels);
  values_[graph_.input] = image;
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    if (absorbed_.count(i) == 0) lower(i);
  }
  if (plan_.output < 0) {
    if (values_.count(graph_.output) == 0) throw ModelError("its output is not computed by any layer");
    plan_.output_channels = values_.at(graph_.output).channels;
    plan_.output = tensor_of(graph_.nodes.back(), graph_.output);
    plan_.lanes = plan_.output_channels;
  }
  if (plan_.output == 0 || plan_.steps.empty()) throw ModelError("computes nothing from its input");
  return std::move(plan_);
}

void Lowering::check_order() const {
  std::set<std::string> known{graph_.input, std::string()};
  for (const auto& [name, array] : graph_.arrays) known.insert(name);
  for (const OnnxNode& node : graph_.nodes) {
    for (const std::string& input : node.inputs) {
      if (known.count(input) == 0) refuse_layer(node, "uses a value that no layer before it computes");
    }
    for (const std::string& output : node.outputs) {
      if (!known.insert(output).second) refuse_layer(node, "computes a value that there is already");
    }
  }
}

void Lowering::count_uses() {
  ++uses_[graph_.output];
  for (const OnnxNode& node : graph_.nodes) {
    for (const std::string& input : node.inputs) ++uses_[input];
  }
}

int Lowering::input_channels() const {
  if (graph_.input_channels < 0 || graph_.input_channels > kMaxChannels)
    throw ModelError("has an absurd input");
  if (graph_.input_channels > 0) return static_cast<int>(graph_.input_channels);
  return 3;
}

int Lowering::add_tensor(int channels) {
  plan_.tensors.push_back({channels, 0, -1, 0});
  return static_cast<int>(plan_.tensors.size()) - 1;
}

std::vector<float> Lowering::numbers(const OnnxNode& node, std::size_t input) const {
  if (node.inputs.size() <= input || node.inputs[input].empty()) return {};
  const OnnxArray* found = graph_.array(node.inputs[input]);
  if (found == nullptr) refuse_layer(node, "has an input that is not a constant");
  return found->values;
}

LoweredValue& Lowering::value(const OnnxNode& node, std::size_t input) {
  if (node.inputs.size() <= input) refuse_layer(node, "lacks an input");
  const auto found = values_.find(node.inputs[input]);
  if (found == values_.end()) refuse_layer(node, "has an input that the own kernels cannot compute");
  return found->second;
}

void Lowering::set(const OnnxNode& node, LoweredValue made) {
  if (node.outputs.size() != 1) refuse_layer(node, "has more than one output");
  if (made.channels < 1 || made.channels > kMaxChannels)
    refuse_layer(node, "has an absurd number of channels");
  values_[node.outputs[0]] = std::move(made);
}

void Lowering::set_step(const OnnxNode& node, PlannedStep step, int channels, bool is_single_pixel) {
  step.layer = node.title();
  LoweredValue made;
  made.channels = channels;
  made.is_single_pixel = is_single_pixel;
  made.step = std::move(step);
  set(node, std::move(made));
}

int Lowering::tensor_of(const OnnxNode& user, const std::string& name) {
  const auto found = values_.find(name);
  if (found == values_.end()) refuse_layer(user, "has an input that the own kernels cannot compute");
  LoweredValue& v = found->second;
  if (v.depthwise)
    refuse_layer(user, "a depthwise convolution is followed by it instead of by a 1x1 convolution");
  if (v.padding != 0) refuse_layer(user, "follows a padding");
  if (v.tensor >= 0) return v.tensor;
  if (v.upsampled >= 0) {
    v.step = PlannedStep{};
    v.step->kind = StepKind::kUpsample;
    v.step->layer = user.title();
    v.step->input = v.upsampled;
  }
  v.tensor = add_tensor(v.channels);
  v.step->output = v.tensor;
  if (v.step->kind == StepKind::kRegionNorm && !v.step->relu)
    refuse_layer(user, "region normalisation without ReLU");
  plan_.steps.push_back(std::move(*v.step));
  v.step.reset();
  return v.tensor;
}

int Lowering::tensor_of(const OnnxNode& node, std::size_t input) {
  value(node, input);
  return tensor_of(node, node.inputs[input]);
}

void Lowering::need_border(int index, int pixels) {
  PlannedTensor* t = &tensor(index);
  while (true) {
    t->border = std::max(t->border, pixels);
    if (t->parent < 0) return;
    t = &tensor(t->parent);
  }
}

void Lowering::lower(std::size_t index) {
  const OnnxNode& node = graph_.nodes[index];
  if (norms_.count(index) != 0) return lower_region_norm(node, norms_.at(index));
  if (node.type == "Conv") return lower_convolution(node);
  if (node.type == "ConvTranspose") return lower_transposed(node);
  if (node.type == "Relu") return lower_relu(node);
  if (node.type == "Add") return lower_add(node);
  if (node.type == "Sub" || node.type == "Mul" || node.type == "Div") return lower_binary(node);
  if (node.type == "Pad") return lower_pad(node);
  if (node.type == "AveragePool" || node.type == "MaxPool") return lower_pool(node);
  if (node.type == "GlobalAveragePool") return lower_global_pool(node);
  if (node.type == "Resize") return lower_resize(node);
  if (node.type == "Concat") return lower_concat(node);
  if (node.type == "Slice") return lower_slice(node);
  if (node.type == "Sigmoid") return lower_sigmoid(node);
  if (node.type == "DepthToSpace") return lower_depth_to_space(node);
  if (node.type == "Cast" && node.attribute("to", {0}) == std::vector<std::int64_t>{1}) {
    const int same = tensor_of(node, 0);
    LoweredValue made = value(node, 0);
    made.tensor = same;
    return set(node, std::move(made));
  }
  refuse_layer(node, "the own kernels have no such layer");
}

NetworkPlan plan_network(const OnnxGraph& graph) {
  if (graph.nodes.empty()) throw ModelError("has no layers");
  if (graph.nodes.size() > kMaxLayers)
    throw ModelError("has more than " + std::to_string(kMaxLayers) + " layers");
  return Lowering(graph).run();
}

}  // namespace roslam
