// SPDX-License-Identifier: BSD-3-Clause
// The steps of a network, row by row (NetworkRunner).
#include <algorithm>
#include <array>
#include <cmath>

#include "roslam/inference/network_runner.hpp"

namespace roslam {

namespace {
// Offset of each tap of a square convolution from its first.
std::array<std::ptrdiff_t, 9> taps_of(const PlannedStep& plan, const TensorView& in) {
  std::array<std::ptrdiff_t, 9> taps{};
  for (int t = 0; t < plan.kernel * plan.kernel; ++t)
    taps[static_cast<std::size_t>(t)] =
        (t / plan.kernel * in.row_step + t % plan.kernel * in.pixel_step) * plan.dilation;
  return taps;
}
}  // namespace

NetworkOutput NetworkRunner::run() {
  for (const PackedStep& step : steps_) run_step(step);
  return {view(plan_.output), plan_.sub_pixels, plan_.lanes, plan_.output_channels};
}

void NetworkRunner::run_step(const PackedStep& step) {
  if (step.plan.kind == StepKind::kGlobalAverage) return average_all(step);
  if (step.plan.kind == StepKind::kRegionNorm) return normalise_regions(step);
  const bool reads_rows = step.plan.kind == StepKind::kDepthToSpace;
  team_.run(view(reads_rows ? step.plan.input : step.plan.output).rows,
            [&](int begin, int end, int thread) { run_rows(step, begin, end, thread); });
}

void NetworkRunner::run_rows(const PackedStep& step, int begin, int end, int thread) const {
  float* scratch = scratch_[static_cast<std::size_t>(thread)].data();
  switch (step.plan.kind) {
    case StepKind::kConvolution:
      return convolve(step, begin, end, scratch);
    case StepKind::kSingleConvolution:
      return convolve_single(step, begin, end);
    case StepKind::kUpsample:
      return upsample(step, begin, end, scratch);
    case StepKind::kBinary:
      return combine(step, begin, end);
    case StepKind::kAveragePool:
      return average(step, begin, end, scratch);
    case StepKind::kMaxPool:
      return maximum(step, begin, end);
    case StepKind::kSigmoid:
      return sigmoid(step, begin, end);
    case StepKind::kDepthToSpace:
      return depth_to_space(step, begin, end);
    default:
      return copy(step, begin, end);
  }
}

void NetworkRunner::convolve(const PackedStep& step, int begin, int end, float* scratch) const {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  const auto taps = taps_of(plan, in);
  ConvolutionRow row;
  row.taps = taps.data();
  row.tap_count = plan.kernel * plan.kernel;
  row.channels = in.channels;
  row.weights = step.weights.data();
  row.bias = step.bias.data();
  row.output_step = out.pixel_step;
  row.outputs = out.channels;
  row.pixels = out.columns;
  row.relu = plan.relu;
  DepthwiseRow depthwise;
  const std::ptrdiff_t whole = padded(in.channels);
  if (plan.depthwise) {
    depthwise.row_step = in.row_step;
    depthwise.pixel_step = in.pixel_step;
    depthwise.stride = plan.depthwise->stride;
    depthwise.channels = in.channels;
    depthwise.weights = step.depthwise_weights.data();
    depthwise.bias = step.depthwise_bias.data();
    depthwise.output = scratch;
    depthwise.output_step = whole;
    depthwise.pixels = out.columns;
    row.input = scratch;
    row.input_step = whole;
    scratch += whole * out.columns;
  } else {
    row.input_step = plan.stride * in.pixel_step;
  }
  for (int y = begin; y < end; ++y) {
    if (plan.depthwise) {
      depthwise.input = in.at(y * depthwise.stride - 1, -1);
      kernels_.convolve_depthwise(depthwise);
    } else {
      row.input = in.at(y * plan.stride - plan.padding, -plan.padding);
    }
    if (plan.doubles_second) {
      float* line = scratch + padded(out.channels) * out.columns;
      row.residual_step = padded(out.channels);
      row.residual = upsampled_row(view(plan.second), y, line, scratch, row.residual_step);
    } else if (plan.second >= 0) {
      row.residual = view(plan.second).at(y, 0);
      row.residual_step = view(plan.second).pixel_step;
    }
    row.output = out.at(y, 0);
    kernels_.convolve(row);
  }
}

void NetworkRunner::convolve_single(const PackedStep& step, int begin, int end) const {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  const auto taps = taps_of(plan, in);
  for (int y = begin; y < end; ++y) {
    kernels_.convolve_single({in.at(y * plan.stride - plan.padding, -plan.padding),
                              plan.stride * in.pixel_step, taps.data(), 9, in.channels, step.weights.data(),
                              plan.bias[0], out.at(y, 0), out.pixel_step, out.columns});
  }
}

// Row `row` of the tensor upsampled to twice its size, written to out; scratch holds one row of the tensor.
const float* NetworkRunner::upsampled_row(const TensorView& from, int row, float* scratch, float* out,
                                          std::ptrdiff_t out_step) const {
  const int nearer = row / 2;
  const int farther = std::clamp(row % 2 == 0 ? nearer - 1 : nearer + 1, 0, from.rows - 1);
  kernels_.upsample({from.at(nearer, 0), from.at(farther, 0), from.pixel_step, from.channels, from.columns,
                     scratch, out, out_step});
  return out;
}

void NetworkRunner::upsample(const PackedStep& step, int begin, int end, float* scratch) const {
  const TensorView& out = view(step.plan.output);
  for (int y = begin; y < end; ++y)
    upsampled_row(view(step.plan.input), y, scratch, out.at(y, 0), out.pixel_step);
}

void NetworkRunner::combine(const PackedStep& step, int begin, int end) const {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  TensorView second;
  if (plan.second >= 0) second = view(plan.second);
  const bool is_spread = second.rows == 1 && second.columns == 1;  // one pixel for all
  const bool by_kernel =
      plan.operation == BinaryOperation::kAdd && plan.second >= 0 && second.channels == in.channels;
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      const float* a = in.at(y, x);
      const float* b = plan.second < 0 ? &plan.number : second.at(is_spread ? 0 : y, is_spread ? 0 : x);
      float* to = out.at(y, x);
      if (by_kernel) {
        kernels_.add(a, b, to, static_cast<std::size_t>(out.channels), plan.relu);
        continue;
      }
      const int b_step = plan.second >= 0 && second.channels > 1 ? 1 : 0;
      for (int c = 0; c < out.channels; ++c) {
        float value = a[c];
        const float other = b[c * b_step];
        switch (plan.operation) {
          case BinaryOperation::kAdd:
            value += other;
            break;
          case BinaryOperation::kSubtract:
            value -= other;
            break;
          case BinaryOperation::kSubtractFrom:
            value = other - value;
            break;
          case BinaryOperation::kMultiply:
            value *= other;
            break;
        }
        to[c] = plan.relu && !(value > 0.0F) ? 0.0F : value;
      }
    }
  }
}

void NetworkRunner::average(const PackedStep& step, int begin, int end, float* scratch) const {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  const auto area = static_cast<float>(plan.kernel * plan.kernel);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      std::fill_n(scratch, padded(in.channels), 0.0F);
      for (int row = 0; row < plan.kernel; ++row) {
        const float* from = in.at(y * plan.stride - plan.padding + row, x * plan.stride - plan.padding);
        kernels_.accumulate(from, in.pixel_step, plan.kernel, in.channels, scratch);
      }
      float* to = out.at(y, x);
      for (int c = 0; c < out.channels; ++c) to[c] = scratch[c] / area;
    }
  }
}

// Sums of rows are added in double precision, or the digits of a large image's mean would be lost.
void NetworkRunner::average_all(const PackedStep& step) {
  const TensorView& in = view(step.plan.input);
  const TensorView& out = view(step.plan.output);
  float* sums = scratch_[0].data();
  std::vector<double> total(static_cast<std::size_t>(in.channels), 0.0);
  for (int y = 0; y < in.rows; ++y) {
    std::fill_n(sums, padded(in.channels), 0.0F);
    kernels_.accumulate(in.at(y, 0), in.pixel_step, in.columns, in.channels, sums);
    for (int c = 0; c < in.channels; ++c) total[static_cast<std::size_t>(c)] += static_cast<double>(sums[c]);
  }
  const double pixels = static_cast<double>(in.rows) * in.columns;
  for (int c = 0; c < out.channels; ++c)
    out.data[c] = static_cast<float>(total[static_cast<std::size_t>(c)] / pixels);
}

void NetworkRunner::maximum(const PackedStep& step, int begin, int end) const {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      for (int c = 0; c < out.channels; ++c) {
        float most = in.at(y * plan.stride, x * plan.stride)[c];
        for (int i = 1; i < plan.kernel * plan.kernel; ++i)
          most =
              std::max(most, in.at(y * plan.stride + i / plan.kernel, x * plan.stride + i % plan.kernel)[c]);
        out.at(y, x)[c] = most;
      }
    }
  }
}

void NetworkRunner::region_row(const PackedStep& step, int row, RegionRow& kernel_row) const {
  const TensorView& in = view(step.plan.input);
  kernel_row.input = in.at(row, 0);
  kernel_row.input_step = in.pixel_step;
  kernel_row.regions = static_cast<int>(step.plan.regions.size());
  for (int r = 0; r < kernel_row.regions; ++r) {
    const TensorView& share = view(step.plan.regions[static_cast<std::size_t>(r)].tensor);
    kernel_row.region[r] = share.at(row, 0);
    kernel_row.region_step[r] = share.pixel_step;
  }
  kernel_row.channels = in.channels;
  kernel_row.pixels = in.columns;
}

// Two passes: sums by row, which are then added in their order, and the normalisation with ReLU and residual.
void NetworkRunner::normalise_regions(const PackedStep& step) {
  const PlannedStep& plan = step.plan;
  const TensorView& in = view(plan.input);
  const TensorView& out = view(plan.output);
  const std::ptrdiff_t whole = padded(in.channels);
  const std::ptrdiff_t of_row = 2 * kMaxRegions * whole;
  float* sums = region_sums_.data();
  team_.run(in.rows, [&](int begin, int end, int) {
    for (int y = begin; y < end; ++y) {
      RegionRow row;
      region_row(step, y, row);
      row.sums = sums + y * of_row;
      std::fill_n(row.sums, of_row, 0.0F);
      kernels_.region_sums(row);
    }
  });
  float* affine = sums + in.rows * of_row;
  const double pixels = static_cast<double>(in.rows) * in.columns;
  for (std::size_t r = 0; r < plan.regions.size(); ++r) {
    const PlannedRegion& region = plan.regions[r];
    const TensorView& share_of = view(region.tensor);
    double share = 0.0;
    for (int y = 0; y < in.rows; ++y) {
      for (int x = 0; x < in.columns; ++x) share += static_cast<double>(*share_of.at(y, x));
    }
    share = share / pixels + 1e-8;  // of an empty region
    for (int c = 0; c < in.channels; ++c) {
      double first = 0.0;
      double second = 0.0;
      const auto at = static_cast<std::ptrdiff_t>(2 * r) * whole + c;
      for (int y = 0; y < in.rows; ++y) {
        first += static_cast<double>(sums[y * of_row + at]);
        second += static_cast<double>(sums[y * of_row + at + whole]);
      }
      const double mean = first / pixels / share;
      const double variance = std::max(second / pixels / share - mean * mean, 0.0);
      const double gain = static_cast<double>(region.scale[static_cast<std::size_t>(c)]) /
                          std::sqrt(variance + static_cast<double>(plan.epsilon));
      affine[at] = static_cast<float>(gain);
      affine[at + whole] =
          static_cast<float>(static_cast<double>(region.shift[static_cast<std::size_t>(c)]) - mean * gain);
    }
  }
  team_.run(in.rows, [&](int begin, int end, int) {
    for (int y = begin; y < end; ++y) {
      RegionRow row;
      region_row(step, y, row);
      row.affine = affine;
      if (plan.second >= 0) {
        row.residual = view(plan.second).at(y, 0);
        row.residual_step = view(plan.second).pixel_step;
      }
      row.output = out.at(y, 0);
      row.output_step = out.pixel_step;
      kernels_.region_apply(row);
    }
  });
}

void NetworkRunner::sigmoid(const PackedStep& step, int begin, int end) const {
  copy(step, begin, end);
  const TensorView& out = view(step.plan.output);
  for (int y = begin; y < end; ++y) {
    if (out.pixel_step == out.channels) {
      kernels_.sigmoid(out.at(y, 0), static_cast<std::size_t>(out.columns * out.channels));
    } else {
      for (int x = 0; x < out.columns; ++x)
        kernels_.sigmoid(out.at(y, x), static_cast<std::size_t>(out.channels));
    }
  }
}

void NetworkRunner::depth_to_space(const PackedStep& step, int begin, int end) const {
  const TensorView& in = view(step.plan.input);
  const TensorView& out = view(step.plan.output);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < in.columns; ++x) {
      const float* from = in.at(y, x);
      for (int c = 0; c < out.channels; ++c) {
        for (int i = 0; i < 4; ++i) out.at(2 * y + i / 2, 2 * x + i % 2)[c] = from[4 * c + i];
      }
    }
  }
}

void NetworkRunner::copy(const PackedStep& step, int begin, int end) const {
  const TensorView& in = view(step.plan.input);
  const TensorView& out = view(step.plan.output);
  for (int y = begin; y < end; ++y) {
    for (int x = 0; x < out.columns; ++x) std::copy_n(in.at(y, x), out.channels, out.at(y, x));
  }
}

}  // namespace roslam
