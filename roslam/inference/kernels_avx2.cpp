// SPDX-License-Identifier: BSD-3-Clause
// Compiled for AVX2 and FMA; called only where the processor has both.
#include "roslam/inference/kernels.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>

namespace roslam {

namespace {
using V = float __attribute__((vector_size(32)));
constexpr const char* kName = "AVX2";
constexpr int kLanes = 8;
constexpr int kVectors = 2;
constexpr int kPixels = 6;

inline V load(const float* from) { return _mm256_loadu_ps(from); }
inline void store(float* to, V value) { _mm256_storeu_ps(to, value); }
inline V broadcast(float value) { return _mm256_set1_ps(value); }
inline V fma(V a, V b, V c) { return _mm256_fmadd_ps(a, b, c); }
inline V maximum(V a, V b) { return _mm256_max_ps(a, b); }
inline V minimum(V a, V b) { return _mm256_min_ps(a, b); }
// value times 2 to the power that the low bits of shifted hold (exponential).
inline V scaled_by_power(V value, V shifted) {
  const __m256i power = _mm256_slli_epi32(_mm256_castps_si256(shifted), 23);
  return _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(value), power));
}
inline V select_positive(V x, V positive, V other) {
  return _mm256_blendv_ps(other, positive, _mm256_cmp_ps(x, _mm256_setzero_ps(), _CMP_GE_OQ));
}
// Keeps the compiler from computing with a value that it knows (peak).
inline void keep(V& value) { __asm__ volatile("" : "+x"(value)); }

#include "roslam/inference/kernels_body.hpp"
}  // namespace

const Kernels* avx2_kernels() { return &kTable; }

}  // namespace roslam
#else
namespace roslam {
const Kernels* avx2_kernels() { return nullptr; }
}  // namespace roslam
#endif
