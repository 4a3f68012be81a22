// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Compiles a function several times: for any processor, and for those that have an instruction set extension
/// of x86-64, such as "avx2" or "popcnt". One binary serves them all: the loader picks the version. Functions
/// that are called in it must be inlined to have part in this. Without GCC or on another processor there is
/// one version. Sanitizers cannot instrument the resolver that picks, hence the exception.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define ROSLAM_TARGET_CLONES(extension) __attribute__((target_clones(extension, "default")))
#else
#define ROSLAM_TARGET_CLONES(extension)
#endif
