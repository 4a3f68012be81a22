# SPDX-License-Identifier: BSD-3-Clause
# Flags of the inference kernels (roslam/inference/kernels.hpp). Each set is compiled for its instruction set and chosen at
# run time. Multiply-adds are fused where the source says so and nowhere else, so that every processor computes the same
# bits. No precompiled headers: an inline function of another header, compiled here for AVX-512, could be linked for all.
set(kernel_flags -O3 -ffp-contract=off -fno-math-errno)
set(kernel_sources inference/kernels_avx2.cpp inference/kernels_avx512.cpp inference/kernels_neon.cpp)
set_source_files_properties(${kernel_sources} PROPERTIES SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${kernel_flags}")
set_source_files_properties(inference/network_steps.cpp PROPERTIES COMPILE_OPTIONS -ffp-contract=off)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64|i[3-6]86)$")
  set_property(SOURCE inference/kernels_avx2.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx2 -mfma)
  set_property(SOURCE inference/kernels_avx512.cpp APPEND PROPERTY COMPILE_OPTIONS
    -mavx2 -mfma -mavx512f -mavx512dq -mavx512bw -mavx512vl)
endif()
