// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/recording.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return roslam::fuzz::read_recording(data, size, {"SQLite format 3\0", 16});
}
