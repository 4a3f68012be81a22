// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <nlohmann/json.hpp>

#include "evaluation/json_number.hpp"
#include "evaluation/map_error.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::evaluation {

namespace {
using Json = nlohmann::ordered_json;

struct Row {
  std::string title;
  std::function<std::string(const EvaluatedMap&)> value;
};

std::string with_unit(double value, int decimals, const char* unit) {
  const std::string text = fixed(value, decimals);
  return text == "-" ? text : text + " " + unit;
}

std::string millimetres(double metres) { return with_unit(1000.0 * metres, 0, "mm"); }

std::vector<Row> rows() {
  return {
      {"points", [](const EvaluatedMap& m) { return std::to_string(m.error.points); }},
      {"accuracy", [](const EvaluatedMap& m) { return percentage(m.error.accuracy); }},
      {"completeness", [](const EvaluatedMap& m) { return percentage(m.error.completeness); }},
      {"F-score", [](const EvaluatedMap& m) { return percentage(m.error.f_score); }},
      {"ghosts", [](const EvaluatedMap& m) { return percentage(m.error.ghosts, 3); }},
      {"holes", [](const EvaluatedMap& m) { return percentage(m.error.holes); }},
      {"missing of the reference",
       [](const EvaluatedMap& m) { return percentage(m.error.missing_of_reference); }},
      {"distance, median", [](const EvaluatedMap& m) { return millimetres(m.error.median_distance); }},
      {"distance, 90 %", [](const EvaluatedMap& m) { return millimetres(m.error.p90_distance); }},
      {"colour error", [](const EvaluatedMap& m) { return fixed(m.error.colour_error, 1); }},
      {"on movable objects at rest", [](const EvaluatedMap& m) { return percentage(m.error.resting); }},
      {"trajectory error", [](const EvaluatedMap& m) { return millimetres(m.trajectory_rmse); }},
  };
}

std::string name_of(Provenance provenance) {
  switch (provenance) {
    case Provenance::kMeasured:
      return "measured";
    case Provenance::kReprojected:
      return "reprojected";
    case Provenance::kInpainted:
      return "inpainted";
  }
  return "unknown";
}

Json json_of(const MapProvenanceError& e) {
  return {{"provenance", name_of(e.provenance)},
          {"points", e.points},
          {"accuracy", number(e.accuracy)},
          {"ghost_points", e.ghost_points},
          {"colour_error_grey_levels", number(e.colour_error)}};
}

Json json_of(const EvaluatedMap& map) {
  const MapError& e = map.error;
  Json json{{"name", map.name},
            {"trajectory_rmse_m", number(map.trajectory_rmse)},
            {"points", e.points},
            {"truth_points", e.truth_points},
            {"ghost_points", e.ghost_points},
            {"resting_points", e.resting_points},
            {"accuracy", number(e.accuracy)},
            {"completeness", number(e.completeness)},
            {"f_score", number(e.f_score)},
            {"ghost_share", number(e.ghosts)},
            {"resting_share", number(e.resting)},
            {"hole_share", number(e.holes)},
            {"missing_of_reference", number(e.missing_of_reference)},
            {"distance_median_m", number(e.median_distance)},
            {"distance_p90_m", number(e.p90_distance)},
            {"colour_error_grey_levels", number(e.colour_error)},
            {"by_provenance", Json::array()}};
  for (const auto& row : e.by_provenance) json["by_provenance"].push_back(json_of(row));
  return json;
}
}  // namespace

std::string to_markdown(const std::vector<EvaluatedMap>& maps) {
  std::vector<TableRow> table{{"map"}};
  for (const auto& map : maps) table.front().push_back(table_cell(map.name));
  for (const auto& row : rows()) {
    table.push_back({row.title});
    for (const auto& map : maps) table.back().push_back(row.value(map));
  }
  std::vector<TableRow> origins{
      {"provenance of points", "points", "accuracy", "ghost points", "colour error"}};
  for (const auto& map : maps) {
    for (const auto& e : map.error.by_provenance) {
      if (e.points == 0) continue;
      origins.push_back({table_cell(map.name) + ", " + name_of(e.provenance), std::to_string(e.points),
                         percentage(e.accuracy), std::to_string(e.ghost_points), fixed(e.colour_error, 1)});
    }
  }
  return markdown_table(table) + "\n" + markdown_table(origins);
}

std::string to_json(const std::vector<EvaluatedMap>& maps, const MapTruthOptions& truth,
                    const MapErrorOptions& options) {
  Json json{{"range_m", truth.range},
            {"tolerance_m", options.tolerance},
            {"gap_m", options.gap},
            {"ghost_reach_m", options.ghost_reach},
            {"estimates", Json::array()}};
  for (const auto& map : maps) json["estimates"].push_back(json_of(map));
  // File names may hold any bytes; those that are not UTF-8 are replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::evaluation
