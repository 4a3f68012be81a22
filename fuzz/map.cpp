// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>

#include "fuzz/fuzz.hpp"
#include "roslam/atlas/map_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    // Behind the checksum, which hardly any damaged file passes. What is read must be a map that can be used.
    const SavedMap saved = decode_map(bytes, "fuzz");
    Map map = SavedMap::of(saved.camera, saved.map, nullptr).map;
    for (const LandmarkId id : map.landmark_ids()) map.refresh(id);
    for (const KeyframeId id : map.keyframe_ids()) map.covisible(id);
    if (encode_map(saved) != bytes && saved.map.keyframe_count() != map.keyframe_count()) std::abort();
  });
}
