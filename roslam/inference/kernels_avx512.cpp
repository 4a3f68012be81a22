// SPDX-License-Identifier: BSD-3-Clause
// Compiled for AVX-512 (F, DQ, BW, VL); called only where the processor has it.
#include "roslam/inference/kernels.hpp"

// GCC 12 warns of the undefined values that its own header passes to masked instructions.
#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>

namespace roslam {

namespace {
using V = float __attribute__((vector_size(64)));
constexpr const char* kName = "AVX-512";
constexpr int kLanes = 16;
constexpr int kVectors = 2;
constexpr int kPixels = 13;

inline V load(const float* from) { return _mm512_loadu_ps(from); }
inline void store(float* to, V value) { _mm512_storeu_ps(to, value); }
inline V broadcast(float value) { return _mm512_set1_ps(value); }
inline V fma(V a, V b, V c) { return _mm512_fmadd_ps(a, b, c); }
inline V maximum(V a, V b) { return _mm512_max_ps(a, b); }
inline V minimum(V a, V b) { return _mm512_min_ps(a, b); }
// value times 2 to the power that the low bits of shifted hold (exponential).
inline V scaled_by_power(V value, V shifted) {
  const __m512i power = _mm512_slli_epi32(_mm512_castps_si512(shifted), 23);
  return _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(value), power));
}
inline V select_positive(V x, V positive, V other) {
  return _mm512_mask_blend_ps(_mm512_cmp_ps_mask(x, _mm512_setzero_ps(), _CMP_GE_OQ), other, positive);
}
// Keeps the compiler from computing with a value that it knows (peak).
inline void keep(V& value) { __asm__ volatile("" : "+v"(value)); }

#include "roslam/inference/kernels_body.hpp"
}  // namespace

const Kernels* avx512_kernels() { return &kTable; }

}  // namespace roslam
#else
namespace roslam {
const Kernels* avx512_kernels() { return nullptr; }
}  // namespace roslam
#endif
