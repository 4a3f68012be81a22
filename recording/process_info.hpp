// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace roslam::recording {

/// Most memory the program has held so far, in bytes; what the program that started it held does not count.
std::size_t peak_memory();

/// Seconds since the process was started, to a hundredth; NaN where the system does not tell.
double process_age();

}  // namespace roslam::recording
