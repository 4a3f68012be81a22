// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/composer_options.hpp"

#include <sstream>

#include "roslam/common/error.hpp"

namespace roslam::simulation {
namespace {

void check(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN too
  std::ostringstream message;
  message << "composer: " << field << " is " << value << ", but must lie in " << low << " to " << high;
  throw OptionsError(message.str());
}

}  // namespace

void ComposerOptions::validate() const {
  check("actors", static_cast<double>(actors), 0, 100);
  check("min_distance", min_distance, 0.3, 100);
  check("max_distance", max_distance, min_distance, 100);
  check("span", span, 0, 100);
  check("camera_height", camera_height, 0, 100);
  check("min_height", min_height, 0.2, 3);
  check("max_height", max_height, min_height, 3);
  check("min_speed", min_speed, 0.05, 10);
  check("max_speed", max_speed, min_speed, 10);
  check("thickness", thickness, 0, 0.25);
  check("noise_floor", noise_floor, 0, 1);
  check("noise_growth", noise_growth, 0, 1);
  check("shadow_baseline", shadow_baseline, -1, 1);
  if (up && !(up->allFinite() && up->norm() > 1e-6))
    throw OptionsError("composer: up must be three finite numbers that are not all 0");
}

}  // namespace roslam::simulation
