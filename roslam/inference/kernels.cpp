// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/kernels.hpp"

namespace roslam {

const Kernels* best_kernels() {
#if defined(__x86_64__) || defined(__i386__)
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return nullptr;
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  if (has_avx512 && avx512_kernels() != nullptr) return avx512_kernels();
  return avx2_kernels();
#else
  return neon_kernels();  // part of every 64-bit ARM processor
#endif
}

}  // namespace roslam
