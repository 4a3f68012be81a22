// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/options/options.hpp"
#include "fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    read_options(file.path()).validate();
  });
}
