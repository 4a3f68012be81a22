// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/removal_error.hpp"

namespace roslam::evaluation {

namespace {
using Json = nlohmann::ordered_json;

TableRow row(const std::string& name, const PointTally& points) {
  return {name, std::to_string(points.kept), std::to_string(points.removed), percentage(points.kept_share()),
          percentage(points.removed_share())};
}

Json json_of(const PointTally& points) {
  return {{"kept", points.kept},
          {"removed", points.removed},
          {"kept_share", number(points.kept_share())},
          {"removed_share", number(points.removed_share())}};
}

std::string skipped(const RemovalError& error) {
  std::string text;
  const auto tell = [&](std::size_t count, const char* what) {
    if (count > 0) text.append(std::to_string(count)).append(" frames ").append(what).append("\n");
  };
  tell(error.without_truth, "skipped: their true mask is missing or unusable");
  tell(error.without_mask, "skipped: their mask in the run is missing or unusable");
  tell(error.not_in_run, "skipped: the run did not process them");
  tell(error.unlike_run, "compared although their number of points differs from the run's");
  return text.empty() ? text : "\n" + text;
}
}  // namespace

std::string to_markdown(const RemovalError& error) {
  const PointTally scene = error.on_static_scene();
  const std::string near = std::to_string(kNearActor) + " pixels of an actor";
  const std::vector<TableRow> rows{{"points on", "kept", "removed", "kept share", "removed share"},
                                   row("actors", error.on_actors),
                                   row("the static scene", scene),
                                   row("- within " + near, error.near_actors),
                                   row("- beyond " + near, error.beyond),
                                   row("movable objects at rest", error.at_rest)};
  const std::string figures = "Of the points that the run kept, " + percentage(error.run_actor_share()) +
                              " lie on actors. Actors cover " + percentage(error.actor_share()) +
                              " of the image, the masks cover " + percentage(error.actor_recall()) +
                              " of the actors and " + percentage(error.removed_share()) + " of the image.";
  return "Points on actors kept: " + percentage(error.on_actors.kept_share()) +
         "; static points wrongly removed: " + percentage(scene.removed_share()) + "; " +
         std::to_string(error.frames) + " frames" + (error.interrupted ? ", interrupted" : "") + "\n\n" +
         markdown_table(rows) + "\n" + figures + "\n" + skipped(error);
}

std::string to_json(const RemovalError& error) {
  Json scene = json_of(error.on_static_scene());
  scene["near_pixels"] = kNearActor;
  scene["near"] = json_of(error.near_actors);
  scene["beyond"] = json_of(error.beyond);
  const Json json{{"actor_points", json_of(error.on_actors)},
                  {"static_points", scene},
                  {"at_rest_points", json_of(error.at_rest)},
                  {"run_points",
                   {{"all", error.run_points},
                    {"on_actors", error.run_points_on_actors},
                    {"share_on_actors", number(error.run_actor_share())}}},
                  {"actor_pixel_recall", number(error.actor_recall())},
                  {"actor_pixel_share", number(error.actor_share())},
                  {"removed_pixel_share", number(error.removed_share())},
                  {"frames",
                   {{"compared", error.frames},
                    {"with_mask", error.with_mask},
                    {"without_truth", error.without_truth},
                    {"without_mask", error.without_mask},
                    {"not_in_run", error.not_in_run},
                    {"unlike_run", error.unlike_run}}},
                  {"interrupted", error.interrupted}};
  return json.dump() + "\n";
}

}  // namespace roslam::evaluation
