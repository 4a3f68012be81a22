// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>

#include "fuzz/fuzz.hpp"
#include "roslam/loop_closing/essential_graph.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/place_recognition/geometric_verifier.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    // Decodes the content without its checksum, which would reject most inputs. The result must be usable.
    const SavedMap saved = decode_map(bytes, "fuzz");
    const std::string written = encode_map(saved);
    if (encode_map(decode_map(written, "fuzz")) != written) std::abort();
    Map map = SavedMap::of(saved.camera, saved.map, nullptr).map;
    for (const LandmarkId id : map.landmark_ids()) map.refresh(id);
    MapMutex mutex;
    for (const KeyframeId id : map.keyframe_ids()) {
      KeyframeSnapshot::of(map, id);
      LocalBundle::around(map, id, {}, {});
      EssentialGraph::of(map, mutex, 1, {map.keyframe_ids().front(), id, SE3()});
    }
  });
}
