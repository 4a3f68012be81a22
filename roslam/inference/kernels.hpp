// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "roslam/inference/plan/limits.hpp"

namespace roslam {

// The inner loops of the own inference engine, one set for each instruction set. All sets compute the same
// bits: each value is one chain of fused multiply-adds whose order does not depend on the width of the
// vectors. Tensors are NHWC, 32-bit floats. Steps are in floats. Loads may read up to kSlack floats beyond
// the channels of a pixel, so that every buffer ends in as many; they are multiplied by weights of zero.
inline constexpr int kSlack = 16;

/// Computes outputs of one row: the sum over taps and input channels, plus bias and residual.
struct ConvolutionRow {
  const float* input = nullptr;          ///< first pixel under the first output pixel
  std::ptrdiff_t input_step = 0;         ///< from the input of one output pixel to the next
  const std::ptrdiff_t* taps = nullptr;  ///< offset of each tap from that pixel
  int tap_count = 0;
  int channels = 0;                 ///< of the input
  const float* weights = nullptr;   ///< packed: panel, tap, channel, output (NetworkRunner::pack)
  const float* bias = nullptr;      ///< padded to whole vectors
  const float* residual = nullptr;  ///< first output pixel's, or null
  std::ptrdiff_t residual_step = 0;
  float* output = nullptr;
  std::ptrdiff_t output_step = 0;
  int outputs = 0;
  int pixels = 0;
  bool relu = false;
};

/// Computes one row of a depthwise 3x3 convolution.
struct DepthwiseRow {
  const float* input = nullptr;   ///< top left pixel under the first output pixel
  std::ptrdiff_t row_step = 0;    ///< of the input
  std::ptrdiff_t pixel_step = 0;  ///< of the input
  int stride = 1;                 ///< 1 or 2
  int channels = 0;
  const float* weights = nullptr;  ///< tap, channel; each tap padded to whole vectors
  const float* bias = nullptr;
  float* output = nullptr;
  std::ptrdiff_t output_step = 0;  ///< whole vectors
  int pixels = 0;
};

/// Computes one row of a convolution with a single output channel, whose lanes run over the input channels.
struct SingleOutputRow {
  const float* input = nullptr;
  std::ptrdiff_t input_step = 0;
  const std::ptrdiff_t* taps = nullptr;
  int tap_count = 0;
  int channels = 0;
  const float* weights = nullptr;  ///< tap, channel; each tap padded to 16 channels with zeros
  float bias = 0.0F;
  float* output = nullptr;
  std::ptrdiff_t output_step = 0;
  int pixels = 0;
};

/// One row of region normalisation (Yu et al., AAAI 2020, eqs. 13 to 17 of the paper).
struct RegionRow {
  const float* input = nullptr;
  std::ptrdiff_t input_step = 0;
  const float* region[kMaxRegions] = {};  ///< share of each pixel that belongs to the region
  std::ptrdiff_t region_step[kMaxRegions] = {};
  int regions = 0;
  int channels = 0;
  int pixels = 0;
  // Sums: share times x and x squared, per region: 2 x padded channels, added to.
  float* sums = nullptr;
  // Normalisation: gain and offset of each region: 2 x padded channels.
  const float* affine = nullptr;
  const float* residual = nullptr;  ///< added after ReLU, or null
  std::ptrdiff_t residual_step = 0;
  float* output = nullptr;
  std::ptrdiff_t output_step = 0;
};

/// Doubles one row bilinearly, pixel centres aligned at half pixels.
struct UpsampleRow {
  const float* nearer = nullptr;   ///< row that gets weight 3/4
  const float* farther = nullptr;  ///< row that gets weight 1/4
  std::ptrdiff_t pixel_step = 0;
  int channels = 0;
  int pixels = 0;            ///< of the input
  float* scratch = nullptr;  ///< pixels x padded channels
  float* output = nullptr;
  std::ptrdiff_t output_step = 0;
};

inline constexpr int kScoreLanes = 20;  ///< scores of a grid point

/// For the grid points of one row: the class of the highest score and its softmax probability.
struct LabelRow {
  const float* scores = nullptr;  ///< kScoreLanes for each point
  std::ptrdiff_t cell_step = 0;   ///< from one cell to the next
  int cells = 0;
  int points_per_cell = 1;  ///< side by side in memory
  std::uint8_t* best = nullptr;
  float* probability = nullptr;
};

/// The loops of one instruction set.
struct Kernels {
  const char* name;  ///< of the instruction set
  int lanes;         ///< floats of a vector; channels are padded to a multiple
  int panel;         ///< outputs computed together
  void (*convolve)(const ConvolutionRow&);
  void (*convolve_depthwise)(const DepthwiseRow&);
  void (*convolve_single)(const SingleOutputRow&);
  void (*upsample)(const UpsampleRow&);
  void (*add)(const float* a, const float* b, float* out, std::size_t count, bool relu);
  void (*accumulate)(const float* input, std::ptrdiff_t step, int pixels, int channels, float* sums);
  void (*region_sums)(const RegionRow&);
  void (*region_apply)(const RegionRow&);
  void (*sigmoid)(float* values, std::size_t count);
  void (*label)(const LabelRow&);
  double (*peak)(int rounds);  ///< multiply-adds of that many rounds that nothing limits but arithmetic
};

// Null where the library was not compiled for the processor's family. Whether the processor has the
// instructions is for the caller to know.
const Kernels* avx2_kernels();
const Kernels* avx512_kernels();
const Kernels* neon_kernels();

/// The fastest kernels that this processor can run; null if it has no fused multiply-add.
const Kernels* best_kernels();

}  // namespace roslam
