// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/fuzz.hpp"
#include "roslam/datasets/tum_source.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    const auto list = read_tum_list(file.path());
    associate_by_time(list, list, 0.02);
  });
}
