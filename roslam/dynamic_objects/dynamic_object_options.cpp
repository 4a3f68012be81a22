// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/dynamic_object_options.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

void DynamicObjectOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("dynamic_objects.") + message);
  };
  require(label_every >= 1 && label_every <= 1000, "label_every must be 1 to 1000 frames");
  require(max_labelled_share > 0.0 && max_labelled_share <= 1.0,
          "max_labelled_share must be above 0 and at most 1");
  require(min_object_share >= 0.0 && min_object_share < 1.0, "min_object_share must be 0 to 1");
  require(min_confidence >= 0.0 && min_confidence <= 1.0, "min_confidence must be 0 to 1");
  require(keep_missed >= 0.0 && keep_missed <= 60.0, "keep_missed must be 0 to 60 seconds");
  require(history_interval > 0.0 && history_interval <= 60.0,
          "history_interval must be above 0 and at most 60 seconds");
  require(history >= history_interval && history <= 40.0 * history_interval,
          "history must be 1 to 40 times history_interval (seconds)");
  require(appearance_tolerance >= 0.0 && appearance_tolerance < 256.0,
          "appearance_tolerance must be 0 to 255 grey levels");
  require(depth_tolerance >= 0.0 && depth_tolerance < 1.0, "depth_tolerance must be 0 to 1");
  require(flow_interval > 0.0 && flow_interval <= 1.0, "flow_interval must be above 0 and at most 1 second");
  require(flow_tolerance > 0.0 && flow_tolerance <= 100.0, "flow_tolerance must be above 0 and at most 100");
  require(rest > 0.0 && rest <= 1000.0, "rest must be above 0 and at most 1000 seconds");
  require(growth >= 0.0 && growth <= 100.0, "growth must be 0 to 100 metres");
  require(edge_band >= 0 && edge_band <= 200, "edge_band must be 0 to 200 pixels");
  require(margin >= 0 && margin <= 200, "margin must be 0 to 200 pixels");
  require(resting_weight >= 0.0 && resting_weight <= 1.0, "resting_weight must be 0 to 1");
  require(scarce_points >= 0, "scarce_points must not be negative");
}

namespace {
struct NamedMode {
  std::string_view name;
  bool labels;
  bool depth_consistency;
  bool flow;
};

constexpr std::array kModes{
    NamedMode{"none", false, false, false},       NamedMode{"labels", true, false, false},
    NamedMode{"geometry", false, true, true},     NamedMode{"both", true, true, true},
    NamedMode{"ds-slam-like", true, false, true}, NamedMode{"dynaslam-like", true, true, false}};
}  // namespace

std::vector<std::string> dynamic_modes() {
  std::vector<std::string> names;
  for (const NamedMode& mode : kModes) names.emplace_back(mode.name);
  return names;
}

std::optional<DynamicObjectOptions> options_of_mode(std::string_view mode, const DynamicObjectOptions& base) {
  const auto* const found =
      std::find_if(kModes.begin(), kModes.end(), [&](const NamedMode& known) { return known.name == mode; });
  if (found == kModes.end()) return std::nullopt;
  DynamicObjectOptions options = base;
  options.labels = found->labels;
  options.depth_consistency = found->depth_consistency;
  options.flow = found->flow;
  if (mode == "ds-slam-like") {
    options.keep_resting = true;
    options.resting_weight = 0.0;
    options.refine = false;
  } else if (mode == "dynaslam-like") {
    options.min_confidence = 0.0;
    options.resting_weight = 0.0;
    options.scarce_points = 0;
  }
  return options;
}

std::string_view mode_of(const DynamicObjectOptions& options) {
  for (const NamedMode& mode : kModes) {
    if (options_of_mode(mode.name, options) == options) return mode.name;
  }
  return options.labels ? "both" : "geometry";
}

}  // namespace roslam
