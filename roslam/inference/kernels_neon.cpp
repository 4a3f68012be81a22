// SPDX-License-Identifier: BSD-3-Clause
// For 64-bit ARM processors, all of which have NEON with fused multiply-add.
#include "roslam/inference/kernels.hpp"

#if defined(__aarch64__)
#include <arm_neon.h>

namespace roslam {

namespace {
using V = float32x4_t;
constexpr const char* kName = "NEON";
constexpr int kLanes = 4;
constexpr int kVectors = 4;
constexpr int kPixels = 6;

inline V load(const float* from) { return vld1q_f32(from); }
inline void store(float* to, V value) { vst1q_f32(to, value); }
inline V broadcast(float value) { return vdupq_n_f32(value); }
inline V fma(V a, V b, V c) { return vfmaq_f32(c, a, b); }
// As x86: the second operand where one is not a number.
inline V maximum(V a, V b) { return vbslq_f32(vcgtq_f32(a, b), a, b); }
inline V minimum(V a, V b) { return vbslq_f32(vcltq_f32(a, b), a, b); }
// value times 2 to the power that the low bits of shifted hold (exponential).
inline V scaled_by_power(V value, V shifted) {
  const int32x4_t power = vshlq_n_s32(vreinterpretq_s32_f32(shifted), 23);
  return vreinterpretq_f32_s32(vaddq_s32(vreinterpretq_s32_f32(value), power));
}
inline V select_positive(V x, V positive, V other) {
  return vbslq_f32(vcgeq_f32(x, vdupq_n_f32(0.0F)), positive, other);
}
// Keeps the compiler from computing with a value that it knows (peak).
inline void keep(V& value) { __asm__ volatile("" : "+w"(value)); }

#include "roslam/inference/kernels_body.hpp"
}  // namespace

const Kernels* neon_kernels() { return &kTable; }

}  // namespace roslam
#else
namespace roslam {
const Kernels* neon_kernels() { return nullptr; }
}  // namespace roslam
#endif
