// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "roslam/inference/plan/onnx_graph.hpp"

namespace roslam {

/// A tensor of the plan. Its size is known once the size of the input is.
struct PlannedTensor {
  int channels = 0;
  int border = 0;   ///< zeros around it that steps read as padding, pixels
  int parent = -1;  ///< tensor that it is a range of channels of; -1: it has memory of its own
  int offset = 0;   ///< first channel within the parent
};

enum class StepKind {
  kConvolution,        ///< 1x1 or 3x3, perhaps after a depthwise 3x3; bias, residual and ReLU included
  kSingleConvolution,  ///< the same with one output channel, without residual and ReLU
  kUpsample,           ///< doubles both sides bilinearly
  kBinary,             ///< element by element, with a tensor or a number
  kAveragePool,
  kGlobalAverage,
  kMaxPool,
  kRegionNorm,  ///< with ReLU; the residual is added after it
  kSigmoid,
  kDepthToSpace,  ///< blocks of 2x2 pixels from groups of four channels
  kCopy,
};

enum class BinaryOperation { kAdd, kSubtract, kSubtractFrom, kMultiply };  ///< kSubtractFrom: second - first

struct DepthwiseWeights {
  int stride = 1;
  std::vector<float> weights;  ///< channel, row, column
  std::vector<float> bias;
};

/// One region of a region normalisation: its share of each pixel and what is learnt.
struct PlannedRegion {
  int tensor = -1;  ///< one channel
  std::vector<float> scale;
  std::vector<float> shift;
};

/// One step of the computation. Tensors are given by their index in the plan.
struct PlannedStep {
  StepKind kind = StepKind::kConvolution;
  std::string layer;  ///< name in the file, for messages
  int input = -1;
  int second = -1;  ///< residual or second operand; -1: none
  int output = -1;
  bool relu = false;
  bool doubles_second = false;  ///< second has half the size and is upsampled
  // Convolutions and pools.
  int kernel = 1;
  int stride = 1;
  int padding = 0;
  int dilation = 1;
  std::vector<float> weights;  ///< output, input, row, column
  std::vector<float> bias;
  std::optional<DepthwiseWeights> depthwise;
  // The rest.
  BinaryOperation operation = BinaryOperation::kAdd;
  float number = 0.0F;  ///< second operand if there is no tensor
  std::vector<PlannedRegion> regions;
  float epsilon = 0.0F;
};

/// What a network computes, in steps that the kernels have. Tensor 0 is the input.
struct NetworkPlan {
  std::vector<PlannedTensor> tensors;
  std::vector<PlannedStep> steps;
  // The input is normalised as (x - mean) / deviation, each by channel.
  std::vector<float> mean;
  std::vector<float> deviation;
  int output = -1;
  int output_channels = 0;
  /// Pixels a side that each pixel of the output tensor holds, and the channels of one of them, padded: the
  /// result of a transposed convolution that is computed as a 1x1 convolution.
  int sub_pixels = 1;
  int lanes = 0;
};

/// Lowers an ONNX graph to steps. Throws ModelError that names the layer which the kernels lack.
NetworkPlan plan_network(const OnnxGraph& graph);

}  // namespace roslam
