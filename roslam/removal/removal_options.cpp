// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/removal_options.hpp"

#include <string>

#include "roslam/error.hpp"

namespace roslam {

void RemovalOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("removal.") + message);
  };
  require(label_every >= 1 && label_every <= 1000, "label_every must be 1 to 1000 frames");
  require(max_labelled_share > 0.0 && max_labelled_share <= 1.0,
          "max_labelled_share must be above 0 and at most 1");
  require(min_object_share >= 0.0 && min_object_share < 1.0, "min_object_share must be 0 to 1");
  require(sure >= 0.0 && sure <= 1.0, "sure must be 0 to 1");
  require(keep_missed >= 0.0 && keep_missed <= 60.0, "keep_missed must be 0 to 60 seconds");
  require(history_interval > 0.0 && history_interval <= 60.0,
          "history_interval must be above 0 and at most 60 seconds");
  require(history >= history_interval && history <= 40.0 * history_interval,
          "history must be 1 to 40 times history_interval (seconds)");
  require(depth_tolerance >= 0.0 && depth_tolerance < 1.0, "depth_tolerance must be 0 to 1");
  require(flow_interval > 0.0 && flow_interval <= 1.0, "flow_interval must be above 0 and at most 1 second");
  require(flow_tolerance > 0.0 && flow_tolerance <= 100.0, "flow_tolerance must be above 0 and at most 100");
  require(rest > 0.0 && rest <= 1000.0, "rest must be above 0 and at most 1000 seconds");
  require(growth >= 0.0 && growth <= 100.0, "growth must be 0 to 100 metres");
  require(edge_band >= 0 && edge_band <= 200, "edge_band must be 0 to 200 pixels");
  require(margin >= 0 && margin <= 200, "margin must be 0 to 200 pixels");
  require(scarce_points >= 0, "scarce_points must not be negative");
}

std::optional<RemovalOptions> removal_from(std::string_view mode, const RemovalOptions& base) {
  RemovalOptions options = base;
  if (mode == "none") {
    options.labels = options.free_space = options.flow = false;
  } else if (mode == "labels") {
    options.labels = true;
    options.free_space = options.flow = false;
  } else if (mode == "geometry") {
    options.labels = false;
    options.free_space = options.flow = true;
  } else if (mode == "both") {
    options.labels = options.free_space = options.flow = true;
  } else {
    return std::nullopt;
  }
  return options;
}

std::string_view mode_of(const RemovalOptions& options) {
  const bool geometry = options.free_space || options.flow;
  if (options.labels) return geometry ? "both" : "labels";
  return geometry ? "geometry" : "none";
}

}  // namespace roslam
