// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/vocabulary.hpp"
#include "fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const Vocabulary vocabulary = Vocabulary::decode(bytes, "fuzz");
    vocabulary.describe(std::vector<Descriptor>{{1, 2, 3, 4}, {~0ULL, 0, ~0ULL, 0}});
  });
}
