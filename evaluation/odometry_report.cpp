// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <nlohmann/json.hpp>

#include "evaluation/json_number.hpp"
#include "evaluation/odometry_error.hpp"
#include "evaluation/plots/markdown_table.hpp"

namespace roslam::evaluation {

namespace {
using Json = nlohmann::ordered_json;

constexpr double kMilli = 1000.0;

double delay_of(const OdometryError& error) {
  return error.delay ? *error.delay * kMilli : std::numeric_limits<double>::quiet_NaN();
}
}  // namespace

std::string to_markdown(const std::vector<EvaluatedOdometry>& runs) {
  std::vector<TableRow> rows{{"run", "frames", "resets", "step RMSE mm", "max mm", "RMSE deg",
                              "velocity RMSE m/s", "turn RMSE deg/s", "delay ms", "NEES", "below 99 %",
                              "above 99 %", "correction m", "tilt deg"}};
  for (const auto& [name, e] : runs) {
    rows.push_back({table_cell(name), std::to_string(e.frames), std::to_string(e.resets),
                    fixed(e.step.rmse * kMilli, 2), fixed(e.step.max * kMilli, 1),
                    fixed(e.step_rotation.rmse, 3), fixed(e.velocity.rmse, 3), fixed(e.turn_rate.rmse, 2),
                    fixed(delay_of(e), 0), fixed(e.nees, 1), percentage(e.below_bounds),
                    percentage(e.above_bounds), fixed(e.largest_correction, 3), fixed(e.tilt, 2)});
  }
  return markdown_table(rows);
}

std::string to_json(const std::vector<EvaluatedOdometry>& runs) {
  Json all = Json::array();
  for (const auto& [name, e] : runs) {
    all.push_back({{"name", name},
                   {"frames", e.frames},
                   {"compared", e.compared},
                   {"resets", e.resets},
                   {"step_rmse_m", number(e.step.rmse)},
                   {"step_median_m", number(e.step.median)},
                   {"step_max_m", number(e.step.max)},
                   {"step_rmse_deg", number(e.step_rotation.rmse)},
                   {"step_max_deg", number(e.step_rotation.max)},
                   {"velocity_rmse_m_per_s", number(e.velocity.rmse)},
                   {"velocity_max_m_per_s", number(e.velocity.max)},
                   {"turn_rate_rmse_deg_per_s", number(e.turn_rate.rmse)},
                   {"delay_ms", number(delay_of(e))},
                   {"nees", number(e.nees)},
                   {"nees_below_99_share", number(e.below_bounds)},
                   {"nees_above_99_share", number(e.above_bounds)},
                   {"largest_correction_m", number(e.largest_correction)},
                   {"tilt_deg", number(e.tilt)}});
  }
  return Json{{"runs", all}}.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace roslam::evaluation
