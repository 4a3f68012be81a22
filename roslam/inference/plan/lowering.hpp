// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/inference/plan/network_plan.hpp"
#include "roslam/inference/plan/onnx_graph.hpp"
#include "roslam/inference/plan/region_norm_pattern.hpp"

namespace roslam {

inline constexpr int kMaxChannels = 1 << 14;  ///< of a tensor

/// A value of the graph: a tensor, or what will be part of the step that uses it.
struct LoweredValue {
  int channels = 0;
  bool is_single_pixel = false;               // after a global pool
  int tensor = -1;                            // -1: not computed yet
  std::optional<PlannedStep> step;            // that computes it, to which more may be added
  int upsampled = -1;                         // tensor whose upsampled copy it is
  int padding = 0;                            // of zeros around the tensor
  std::optional<DepthwiseWeights> depthwise;  // of the tensor
  bool is_image = false;                      // the input, of which only the normalisation was applied
};

/// Throws ModelError naming the layer.
[[noreturn]] void refuse_layer(const OnnxNode& node, const std::string& why);

/// Lowers a graph layer by layer. What can become part of the step after it waits as a LoweredValue.
class Lowering {
 public:
  explicit Lowering(const OnnxGraph& graph);
  NetworkPlan run();

 private:
  // Each value has to be computed before it is used, and once.
  void check_order() const;
  void count_uses();
  int input_channels() const;
  int add_tensor(int channels);
  PlannedTensor& tensor(int index) { return plan_.tensors[static_cast<std::size_t>(index)]; }
  // The numbers of a constant input; nothing if it is left out.
  std::vector<float> numbers(const OnnxNode& node, std::size_t input) const;
  LoweredValue& value(const OnnxNode& node, std::size_t input);
  bool is_used_once(const std::string& name) const { return uses_.at(name) == 1; }
  void set(const OnnxNode& node, LoweredValue made);
  void set_step(const OnnxNode& node, PlannedStep step, int channels, bool is_single_pixel = false);
  // The tensor of a value, which becomes part of the plan if it is not yet.
  int tensor_of(const OnnxNode& user, const std::string& name);
  int tensor_of(const OnnxNode& node, std::size_t input);
  void need_border(int index, int pixels);
  void lower(std::size_t index);
  struct Shape {
    int outputs = 0;
    int inputs = 0;  // of a group
    int kernel = 0;
    int stride = 1;
    int dilation = 1;
    int padding = 0;
    int groups = 1;
  };
  // The shape of a square convolution whose padding keeps the size at stride 1.
  Shape shape_of(const OnnxNode& node) const;
  std::vector<float> bias_of(const OnnxNode& node, int outputs) const;
  void lower_convolution(const OnnxNode& node);
  void lower_depthwise(const OnnxNode& node, const Shape& shape);
  // A transposed 2x2 convolution at the end: each input pixel becomes 2x2 outputs, by a 1x1 convolution.
  void lower_transposed(const OnnxNode& node);
  void lower_region_norm(const OnnxNode& node, const RegionNormMatch& norm);
  void lower_relu(const OnnxNode& node);
  // Whether the other operand can be added in the epilogue of the step.
  bool takes_residual(const OnnxNode& node, std::size_t input);
  void lower_add(const OnnxNode& node);
  void lower_binary(const OnnxNode& node);
  // Folds a constant by channel into the reading of the image. False if it cannot.
  bool normalise_image(const OnnxNode& node, const std::vector<float>& constant);
  void lower_sigmoid(const OnnxNode& node);
  void lower_pad(const OnnxNode& node);
  void lower_pool(const OnnxNode& node);
  void lower_global_pool(const OnnxNode& node);
  void lower_resize(const OnnxNode& node);
  // The inputs of a concatenation write into its channels, where they can.
  void lower_concat(const OnnxNode& node);
  void lower_slice(const OnnxNode& node);
  void lower_depth_to_space(const OnnxNode& node);
  const OnnxGraph& graph_;
  NetworkPlan plan_;
  std::map<std::string, LoweredValue> values_;
  std::map<std::string, int> uses_;
  std::map<std::size_t, RegionNormMatch> norms_;
  std::set<std::size_t> absorbed_;  // nodes that are part of a region normalisation
};

}  // namespace roslam
