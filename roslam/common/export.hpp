// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Marks what a shared libroslam exports; everything else is hidden (-fvisibility=hidden).
#if defined(__GNUC__)
#define ROSLAM_EXPORT __attribute__((visibility("default")))
#else
#define ROSLAM_EXPORT
#endif
