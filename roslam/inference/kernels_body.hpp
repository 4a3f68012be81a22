// SPDX-License-Identifier: BSD-3-Clause
// The loops of kernels.hpp over vectors of one instruction set; included by kernels_*.cpp, which define V
// (vector of kLanes floats), kLanes, kVectors (vectors of a panel), kPixels (pixels of a tile), load, store,
// broadcast, fma and maximum. Nothing here may be an inline function of other translation units: the linker
// would be free to take the copy compiled for this instruction set everywhere.

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

template <int P, int N>
void convolve_pixels(const ConvolutionRow& row, int first, int count, const float* weights,
                     int first_output) {
  if constexpr (P > 0) {
    if (count == P) {
      convolve_tile<P, N>(row, first, weights, first_output);
    } else {
      convolve_pixels<P - 1, N>(row, first, count, weights, first_output);
    }
  }
}

// All pixels of a row for one panel, in nearly equal tiles.
template <int N>
void convolve_panel(const ConvolutionRow& row, const float* weights, int first_output) {
  const int tiles = (row.pixels + kPixels - 1) / kPixels;
  int first = 0;
  for (int i = 0; i < tiles; ++i) {
    const int count = (row.pixels - first + tiles - i - 1) / (tiles - i);
    convolve_pixels<kPixels, N>(row, first, count, weights, first_output);
    first += count;
  }
}

template <int N>
void convolve_rest(const ConvolutionRow& row, int vectors, const float* weights, int first_output) {
  if constexpr (N > 0) {
    if (vectors == N) {
      convolve_panel<N>(row, weights, first_output);
    } else {
      convolve_rest<N - 1>(row, vectors, weights, first_output);
    }
  }
}

void convolve(const ConvolutionRow& row) {
  const float* weights = row.weights;
  for (int output = 0; output < row.outputs; output += kPanel) {
    const int left = row.outputs - output;
    const int vectors = left >= kPanel ? kVectors : (left + kLanes - 1) / kLanes;
    convolve_rest<kVectors>(row, vectors, weights, output);
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

template <int P, int S>
inline void depthwise_pixels(const DepthwiseRow& row, int count, const float* input, float* out, int whole) {
  if constexpr (P > 0) {
    if (count == P) {
      depthwise_tile<P, S>(row, input, out, whole);
    } else {
      depthwise_pixels<P - 1, S>(row, count, input, out, whole);
    }
  }
}

template <int S>
inline void depthwise_strided(const DepthwiseRow& row) {
  const int tiles = (row.pixels + kDepthwisePixels - 1) / kDepthwisePixels;
  int first = 0;
  for (int i = 0; i < tiles; ++i) {
    const int count = (row.pixels - first + tiles - i - 1) / (tiles - i);
    depthwise_pixels<kDepthwisePixels, S>(row, count, row.input + first * S * row.pixel_step,
                                          row.output + first * row.output_step, padded(row.channels));
    first += count;
  }
}

void convolve_depthwise(const DepthwiseRow& row) {
  if (row.stride == 1) {
    depthwise_strided<1>(row);
  } else {
    depthwise_strided<2>(row);
  }
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

void upsample(const UpsampleRow& row) {
  const V near = broadcast(0.75F);
  const V far = broadcast(0.25F);
  const int whole = padded(row.channels);
  for (int p = 0; p < row.pixels; ++p) {
    for (int c = 0; c < whole; c += kLanes) {
      const V vertical = fma(near, load(row.nearer + p * row.pixel_step + c),
                             far * load(row.farther + p * row.pixel_step + c));
      store(row.scratch + p * whole + c, vertical);
    }
  }
  for (int p = 0; p < row.pixels; ++p) {
    const float* here = row.scratch + p * whole;
    const float* before = p > 0 ? here - whole : here;
    const float* after = p + 1 < row.pixels ? here + whole : here;
    float* out = row.output + 2 * p * row.output_step;
    for (int c = 0; c < row.channels; c += kLanes) {
      const V nearer = near * load(here + c);
      store_first(out + c, fma(far, load(before + c), nearer), row.channels - c);
      store_first(out + row.output_step + c, fma(far, load(after + c), nearer), row.channels - c);
    }
  }
}

// The buffers of whole vectors have room for the lanes beyond count.
void add(const float* a, const float* b, float* out, std::size_t count, bool relu) {
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    V value = load(a + i) + load(b + i);
    if (relu) value = maximum(value, V{});
    store(out + i, value);
  }
  for (; i < count; ++i) {
    const float value = a[i] + b[i];
    out[i] = relu && !(value > 0.0F) ? 0.0F : value;
  }
}

void accumulate(const float* input, std::ptrdiff_t step, int pixels, int channels, float* sums) {
  for (int c = 0; c < channels; c += kLanes) {
    V sum = load(sums + c);
    for (int p = 0; p < pixels; ++p) sum += load(input + p * step + c);
    store(sums + c, sum);
  }
}

template <int R>
inline void region_sums_of(const RegionRow& row) {
  const int whole = padded(row.channels);
  for (int c = 0; c < whole; c += kLanes) {
    V first[R];
    V second[R];
    for (int r = 0; r < R; ++r) {
      first[r] = load(row.sums + 2 * r * whole + c);
      second[r] = load(row.sums + (2 * r + 1) * whole + c);
    }
    for (int p = 0; p < row.pixels; ++p) {
      const V x = load(row.input + p * row.input_step + c);
#pragma GCC unroll 3
      for (int r = 0; r < R; ++r) {
        const V part = broadcast(row.region[r][p * row.region_step[r]]) * x;
        first[r] += part;
        second[r] = fma(part, x, second[r]);
      }
    }
    for (int r = 0; r < R; ++r) {
      store(row.sums + 2 * r * whole + c, first[r]);
      store(row.sums + (2 * r + 1) * whole + c, second[r]);
    }
  }
}

template <int R>
inline void region_apply_of(const RegionRow& row) {
  const int whole = padded(row.channels);
  for (int c = 0; c < row.channels; c += kLanes) {
    V gain[R];
    V offset[R];
    for (int r = 0; r < R; ++r) {
      gain[r] = load(row.affine + 2 * r * whole + c);
      offset[r] = load(row.affine + (2 * r + 1) * whole + c);
    }
    for (int p = 0; p < row.pixels; ++p) {
      V factor{};
      V addend{};
#pragma GCC unroll 3
      for (int r = 0; r < R; ++r) {
        const V share = broadcast(row.region[r][p * row.region_step[r]]);
        factor = fma(gain[r], share, factor);
        addend = fma(offset[r], share, addend);
      }
      V value = maximum(fma(load(row.input + p * row.input_step + c), factor, addend), V{});
      if (row.residual != nullptr) value += load(row.residual + p * row.residual_step + c);
      store_first(row.output + p * row.output_step + c, value, row.channels - c);
    }
  }
}

void region_sums(const RegionRow& row) { row.regions == 2 ? region_sums_of<2>(row) : region_sums_of<3>(row); }

void region_apply(const RegionRow& row) {
  row.regions == 2 ? region_apply_of<2>(row) : region_apply_of<3>(row);
}

// exp(x) for x <= 0: 2^n times a polynomial of the rest (Taylor to the seventh power within half of log 2;
// its error is below one unit in the last place of a float).
inline V exponential(V x) {
  x = maximum(x, broadcast(-87.0F));
  const V magic = broadcast(12582912.0F);  // 1.5 * 2^23: adding it rounds to an integer
  const V shifted = fma(x, broadcast(1.44269504F), magic);
  const V whole = shifted - magic;
  V rest = fma(whole, broadcast(-0.693359375F), x);
  rest = fma(whole, broadcast(2.12194440e-4F), rest);
  V value = broadcast(1.0F / 5040.0F);
  value = fma(value, rest, broadcast(1.0F / 720.0F));
  value = fma(value, rest, broadcast(1.0F / 120.0F));
  value = fma(value, rest, broadcast(1.0F / 24.0F));
  value = fma(value, rest, broadcast(1.0F / 6.0F));
  value = fma(value, rest, broadcast(0.5F));
  value = fma(value, rest, broadcast(1.0F));
  value = fma(value, rest, broadcast(1.0F));
  return scaled_by_power(value, shifted);
}

void sigmoid(float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    float lanes[kLanes] = {};
    const std::size_t used = count - i < kLanes ? count - i : kLanes;
    __builtin_memcpy(lanes, values + i, used * sizeof(float));
    const V x = load(lanes);
    const V one = broadcast(1.0F);
    const V e = exponential(minimum(x, V{} - x));  // of -|x|
    store(lanes, select_positive(x, one / (one + e), e / (one + e)));
    __builtin_memcpy(values + i, lanes, used * sizeof(float));
  }
}

// Vectors of any width cover 32 lanes; those beyond the scores are not used.
inline void label_point(const float* scores, std::uint8_t& label_of_point, float& probability) {
  int best = 0;
  float highest = scores[0];
  for (int c = 1; c < kScoreLanes; ++c) {
    const bool is_better = scores[c] > highest;
    highest = is_better ? scores[c] : highest;
    best = is_better ? c : best;
  }
  alignas(64) float shares[32];
  for (int c = 0; c < kScoreLanes; c += kLanes)
    store(shares + c, exponential(load(scores + c) - broadcast(highest)));
  float four[4];
  for (int i = 0; i < 4; ++i)
    four[i] = shares[i] + shares[i + 4] + shares[i + 8] + shares[i + 12] + shares[i + 16];
  label_of_point = static_cast<std::uint8_t>(best);
  probability = 1.0F / ((four[0] + four[2]) + (four[1] + four[3]));
}

void label(const LabelRow& row) {
  int point = 0;
  for (int cell = 0; cell < row.cells; ++cell) {
    for (int i = 0; i < row.points_per_cell; ++i, ++point)
      label_point(row.scores + cell * row.cell_step + i * kScoreLanes, row.best[point],
                  row.probability[point]);
  }
}

// Chains of multiply-adds, as many at once as hide their latency.
double peak(int rounds) {
  constexpr int kChains = kVectors * kPixels > 12 ? 24 : 12;
  V sum[kChains];
  for (int i = 0; i < kChains; ++i) sum[i] = broadcast(static_cast<float>(i));
  V factor = broadcast(0.5F);
  for (int r = 0; r < rounds; ++r) {
#pragma GCC unroll 24
    for (int i = 0; i < kChains; ++i) sum[i] = fma(sum[i], factor, factor);
    keep(factor);
  }
  V total{};
  for (int i = 0; i < kChains; ++i) total += sum[i];
  volatile float sink = total[0];
  (void)sink;
  return static_cast<double>(rounds) * kChains * kLanes;
}

const Kernels kTable{kName,           kLanes,   kPanel, convolve,   convolve_depthwise,
                     convolve_single, upsample, add,    accumulate, region_sums,
                     region_apply,    sigmoid,  label,  peak};
