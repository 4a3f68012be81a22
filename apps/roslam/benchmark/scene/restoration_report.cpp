// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/roslam/benchmark/scene/restoration_benchmark.hpp"
#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
using Json = nlohmann::ordered_json;

std::string percent(double share) { return fixed(100.0 * share, 1); }

double ratio(std::size_t part, std::size_t all) {
  return static_cast<double>(part) / static_cast<double>(all);
}

TableRow row_of(const std::string& method, const RestorationError& e, double milliseconds) {
  return {method,
          fixed(e.psnr, 2),
          fixed(e.ssim, 3),
          fixed(e.l1, 1),
          percent(ratio(e.reprojected_pixels, e.hole_pixels)),
          percent(e.depth_error_reprojected) + " / " + percent(e.depth_error_inpainted),
          percent(ratio(e.matched_points, e.true_points)),
          percent(e.movable_share),
          fixed(milliseconds, 0)};
}

std::string table(const RestoredSequence& sequence, bool behind) {
  std::vector<TableRow> rows{{"method", "PSNR dB", "SSIM", "L1", "reprojected %",
                              "depth error % reprojected / inpainted", "ORB points matched %",
                              "labelled movable %", "ms per frame"}};
  for (const auto& result : sequence.results) {
    if (behind && !result.behind) return "";
    rows.push_back(row_of(result.method, behind ? *result.behind : result.all, result.milliseconds));
  }
  return markdown_table(rows);
}

std::string section(const RestoredSequence& sequence) {
  std::ostringstream text;
  text << "\n## " << sequence.sequence.name << "\n\n";
  if (!sequence.failure.empty()) return text.str() + "Failed: " + sequence.failure + "\n";
  if (sequence.results.empty()) return text.str() + "Interrupted.\n";
  const RestorationError& error = sequence.results.front().all;
  text << error.with_hole << " frames; " << percent(ratio(error.hole_pixels, error.pixels))
       << " % of the image was removed and restored.\n\nAll restored pixels:\n\n"
       << table(sequence, false);
  if (const auto behind = table(sequence, true); !behind.empty())
    text << "\nOnly pixels where an actor hid the background:\n\n" << behind;
  if (!sequence.figure.empty()) {
    text << "\nAs taken, the truth";
    for (const auto& result : sequence.results) text << ", " << result.method;
    text << ":\n\n![restored](" << sequence.figure << ")\n";
  }
  return text.str();
}
}  // namespace

std::string restoration_markdown(const RestorationReport& report) {
  std::ostringstream text;
  text << "# Restoration of the static scene\n\nRO-SLAM " << report.version << " on " << report.processor
       << ", " << report.cores << " cores. One frame in " << report.every
       << " was restored. Values are of the pixels inside the holes: PSNR, SSIM and absolute error (L1, grey "
          "levels) are means over frames, depth errors medians over pixels. Reprojection alone leaves pixels "
          "black that no other image shows; they count. Time is of one core.\n";
  if (report.is_interrupted) text << "\nInterrupted: sequences are missing.\n";
  for (const auto& sequence : report.sequences) text << section(sequence);
  return text.str();
}

std::string restoration_json(const RestorationReport& report) {
  Json json{
      {"version", report.version}, {"processor", report.processor},        {"cores", report.cores},
      {"every", report.every},     {"interrupted", report.is_interrupted}, {"sequences", Json::array()}};
  for (const auto& sequence : report.sequences) {
    Json entry{{"name", sequence.sequence.name},
               {"source", sequence.sequence.source},
               {"failure", sequence.failure.empty() ? Json(nullptr) : Json(sequence.failure)},
               {"methods", Json::object()}};
    for (const auto& result : sequence.results) {
      entry["methods"][result.method] = {
          {"all", Json::parse(to_json(result.all))},
          {"behind_actors", result.behind ? Json::parse(to_json(*result.behind)) : Json(nullptr)},
          {"processor_milliseconds_a_frame", number(result.milliseconds)}};
    }
    json["sequences"].push_back(entry);
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::app
