// SPDX-License-Identifier: BSD-3-Clause
// The loops of kernels.hpp over vectors of one instruction set. Included by kernels_*.cpp inside an unnamed
// namespace, after they have defined V (vector of kLanes floats), kName, kLanes, kVectors (vectors of a
// panel), kPixels (pixels of a tile), load, store, broadcast, fma, maximum, minimum, scaled_by_power,
// select_positive and keep. Nothing here may be an inline function of other translation units: the linker
// would be free to take the copy compiled for this instruction set everywhere.

#include "roslam/inference/kernels_convolution.hpp"

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
