// SPDX-License-Identifier: BSD-3-Clause
// The convolutions of kernels.hpp; part of kernels_body.hpp, whose preamble holds here as well.

constexpr int kPanel = kVectors * kLanes;
constexpr int kDepthwisePixels = 6;  // of a tile

// Stores the first lanes of a vector.
inline void store_first(float* to, V value, int lanes) {
  if (lanes >= kLanes) {
    store(to, value);
  } else {
    float all[kLanes];
    __builtin_memcpy(all, &value, sizeof(all));
    for (int i = 0; i < lanes; ++i) to[i] = all[i];
  }
}

inline int padded(int channels) { return (channels + kLanes - 1) / kLanes * kLanes; }

// Calls the work with a number of 1 to kMost as a constant.
template <int kMost, typename Work>
inline void with_constant(int number, const Work& work) {
  if constexpr (kMost > 0) {
    if (number == kMost) {
      work.template operator()<kMost>();
    } else {
      with_constant<kMost - 1>(number, work);
    }
  }
}

// Divides a row of pixels into nearly equal tiles of at most kMost; the work is given the first pixel of
// each.
template <int kMost, typename Work>
inline void for_each_tile(int pixels, const Work& work) {
  const int tiles = (pixels + kMost - 1) / kMost;
  int first = 0;
  for (int i = 0; i < tiles; ++i) {
    const int count = (pixels - first + tiles - i - 1) / (tiles - i);
    with_constant<kMost>(count, [&]<int P>() { work.template operator()<P>(first); });
    first += count;
  }
}

// Adds the residual, applies ReLU and writes the outputs of a tile.
template <int P, int N, bool kResidual>
inline void finish_tile(const ConvolutionRow& row, int first, int first_output, const float* sums) {
  const int last_lanes = row.outputs - first_output - (N - 1) * kLanes;
  const V least = broadcast(row.relu ? 0.0F : -__builtin_inff());
  float* out = row.output + first * row.output_step + first_output;
  const float* residual = kResidual ? row.residual + first * row.residual_step + first_output : nullptr;
#pragma GCC unroll 16
  for (int p = 0; p < P; ++p) {
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n) {
      V value = load(sums + (p * N + n) * kLanes);
      if constexpr (kResidual) value += load(residual + n * kLanes);
      value = maximum(value, least);
      n + 1 < N ? store(out + n * kLanes, value) : store_first(out + n * kLanes, value, last_lanes);
    }
    out += row.output_step;
    if constexpr (kResidual) residual += row.residual_step;
  }
}

// Matrix product of P pixels and N vectors of outputs.
template <int P, int N>
void convolve_tile(const ConvolutionRow& row, int first, const float* weights, int first_output) {
  V sum[P][N];
#pragma GCC unroll 16
  for (int n = 0; n < N; ++n) {
    const V bias = load(row.bias + first_output + n * kLanes);
#pragma GCC unroll 16
    for (int p = 0; p < P; ++p) sum[p][n] = bias;
  }
  const std::ptrdiff_t step = row.input_step;
  for (int t = 0; t < row.tap_count; ++t) {
    const float* x = row.input + first * step + row.taps[t];
    const float* const end = x + row.channels;
    for (; x != end; ++x) {
      V w[N];
#pragma GCC unroll 16
      for (int n = 0; n < N; ++n) w[n] = load(weights + n * kLanes);
      weights += N * kLanes;
#pragma GCC unroll 16
      for (int p = 0; p < P; ++p) {
        const V value = broadcast(x[p * step]);
#pragma GCC unroll 16
        for (int n = 0; n < N; ++n) sum[p][n] = fma(value, w[n], sum[p][n]);
      }
    }
  }
  // Through memory, as GCC keeps sums in registers only where nothing else is done with them.
  alignas(64) float result[P][N * kLanes];
#pragma GCC unroll 16
  for (int p = 0; p < P; ++p) {
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n) store(&result[p][n * kLanes], sum[p][n]);
  }
  if (row.residual != nullptr) {
    finish_tile<P, N, true>(row, first, first_output, &result[0][0]);
  } else {
    finish_tile<P, N, false>(row, first, first_output, &result[0][0]);
  }
}

void convolve(const ConvolutionRow& row) {
  const float* weights = row.weights;
  for (int output = 0; output < row.outputs; output += kPanel) {
    const int left = row.outputs - output;
    const int vectors = left >= kPanel ? kVectors : (left + kLanes - 1) / kLanes;
    with_constant<kVectors>(vectors, [&]<int N>() {
      for_each_tile<kPixels>(row.pixels,
                             [&]<int P>(int first) { convolve_tile<P, N>(row, first, weights, output); });
    });
    weights += static_cast<std::ptrdiff_t>(row.tap_count) * row.channels * vectors * kLanes;
  }
}

// Depthwise 3x3: P pixels, all channels one vector after the other, so that memory is read in sequence. What
// is read from the struct is copied first, as stores of vectors may alias it.
template <int P, int S>
inline void depthwise_tile(const DepthwiseRow& row, const float* input, float* out, int whole) {
  constexpr int kColumns = (P - 1) * S + 3;
  const std::ptrdiff_t step = row.pixel_step;
  const std::ptrdiff_t out_step = row.output_step;
  const float* lines[3] = {input, input + row.row_step, input + 2 * row.row_step};
  const float* weights = row.weights;
  const float* biases = row.bias;
  for (int c = 0; c < whole; c += kLanes) {
    V sum[P];
    const V bias = load(biases + c);
#pragma GCC unroll 8
    for (int p = 0; p < P; ++p) sum[p] = bias;
#pragma GCC unroll 3
    for (int y = 0; y < 3; ++y) {
      const float* w = weights + 3 * y * whole + c;
      const V weight[3] = {load(w), load(w + whole), load(w + 2 * whole)};
      const float* x = lines[y] + c;
#pragma GCC unroll 16
      for (int i = 0; i < kColumns; ++i) {
        const V value = load(x);
        x += step;
#pragma GCC unroll 8
        for (int p = 0; p < P; ++p) {
          if (i >= p * S && i < p * S + 3) sum[p] = fma(value, weight[i - p * S], sum[p]);
        }
      }
    }
    float* to = out + c;
#pragma GCC unroll 8
    for (int p = 0; p < P; ++p) {
      store(to, sum[p]);
      to += out_step;
    }
  }
}

template <int S>
inline void depthwise_strided(const DepthwiseRow& row) {
  for_each_tile<kDepthwisePixels>(row.pixels, [&]<int P>(int first) {
    depthwise_tile<P, S>(row, row.input + first * S * row.pixel_step, row.output + first * row.output_step,
                         padded(row.channels));
  });
}

void convolve_depthwise(const DepthwiseRow& row) {
  row.stride == 1 ? depthwise_strided<1>(row) : depthwise_strided<2>(row);
}

// The sum of 16 lanes, whatever the width of a vector.
inline float sum_of_16(const float* lane) {
  float eight[8];
  for (int i = 0; i < 8; ++i) eight[i] = lane[i] + lane[i + 8];
  for (int i = 0; i < 4; ++i) eight[i] += eight[i + 4];
  return (eight[0] + eight[2]) + (eight[1] + eight[3]);
}

void convolve_single(const SingleOutputRow& row) {
  constexpr int kGroup = 16;
  constexpr int kParts = kGroup / kLanes;
  const int whole = (row.channels + kGroup - 1) / kGroup * kGroup;
  for (int p = 0; p < row.pixels; ++p) {
    V sum[kParts] = {};
    for (int t = 0; t < row.tap_count; ++t) {
      const float* x = row.input + p * row.input_step + row.taps[t];
      const float* w = row.weights + t * whole;
      for (int c = 0; c < whole; c += kGroup) {
#pragma GCC unroll 4
        for (int i = 0; i < kParts; ++i)
          sum[i] = fma(load(x + c + i * kLanes), load(w + c + i * kLanes), sum[i]);
      }
    }
    float lanes[kGroup];
    __builtin_memcpy(lanes, sum, sizeof(lanes));
    row.output[p * row.output_step] = sum_of_16(lanes) + row.bias;
  }
}
