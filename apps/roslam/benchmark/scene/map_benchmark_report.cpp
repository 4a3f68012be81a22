// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/roslam/benchmark/scene/map_benchmark.hpp"
#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
using Json = nlohmann::ordered_json;

std::string section(const MappedSequence& sequence) {
  std::ostringstream text;
  text << "\n## " << sequence.sequence.name << "\n\n";
  if (!sequence.failure.empty()) return text.str() + "Failed: " + sequence.failure + "\n";
  if (sequence.maps.empty()) return text.str() + "Interrupted.\n";
  text << to_markdown(sequence.maps)
       << "\nOf the surface of the empty scene that is missing with rejection only, "
       << fixed(100.0 * sequence.filled_share(), 1)
       << " % is filled by reprojection and inpainting.\nFusing a keyframe took "
       << fixed(sequence.fuse_milliseconds, 0) << " ms of one core (median); voxels took "
       << fixed(sequence.voxel_megabytes, 0) << " MB after " << fixed(sequence.path_length, 1)
       << " m, the whole program " << fixed(sequence.peak_megabytes, 0) << " MB.\n";
  if (!sequence.figure.empty()) {
    text << "\nFrom the front and from above";
    for (const auto& map : sequence.maps) text << ", " << map.name;
    text << ":\n\n![maps](" << sequence.figure << ")\n";
  }
  return text.str();
}
}  // namespace

std::string map_benchmark_markdown(const MapBenchmarkReport& report) {
  std::ostringstream text;
  text << "# Dense maps\n\nRO-SLAM " << report.version << " on " << report.processor << ", " << report.cores
       << " cores, one run each, deterministic mode. Maps are aligned with the ground truth by the poses of "
          "their runs and compared with its static surface: see `roslam evaluate map`. Missing is the share "
          "of the truth that the map of the empty scene covers and this one does not. Compared up to "
       << fixed(report.range, 1) << " m from a camera pose. Simulated flights: traffic "
       << report.settings.traffic << ", "
       << (report.settings.frames == 0 ? "all" : std::to_string(report.settings.frames)) << " frames, seed "
       << report.settings.seed << ".\n";
  if (report.is_interrupted) text << "\nInterrupted: sequences are missing.\n";
  for (const auto& sequence : report.sequences) text << section(sequence);
  return text.str();
}

std::string map_benchmark_json(const MapBenchmarkReport& report) {
  Json json{{"version", report.version},
            {"processor", report.processor},
            {"cores", report.cores},
            {"interrupted", report.is_interrupted},
            {"range_m", report.range},
            {"simulation",
             {{"traffic", report.settings.traffic},
              {"frames", report.settings.frames},
              {"seed", report.settings.seed}}},
            {"sequences", Json::array()}};
  for (const auto& sequence : report.sequences) {
    json["sequences"].push_back(
        {{"name", sequence.sequence.name},
         {"source", sequence.sequence.source},
         {"failure", sequence.failure.empty() ? Json(nullptr) : Json(sequence.failure)},
         {"maps", Json::parse(to_json(sequence.maps, {}, {})).at("estimates")},
         {"filled_share", number(sequence.filled_share())},
         {"fuse_milliseconds", number(sequence.fuse_milliseconds)},
         {"voxel_megabytes", number(sequence.voxel_megabytes)},
         {"peak_megabytes", number(sequence.peak_megabytes)},
         {"path_length_metres", number(sequence.path_length)}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::app
