// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "roslam/evaluation/json_number.hpp"
#include "roslam/evaluation/markdown_table.hpp"
#include "roslam/evaluation/restoration_error.hpp"

namespace roslam {

namespace {
double share(double part, double all) { return part / all; }  // NaN for nothing of nothing

std::string percent(double value) { return fixed(100.0 * value, 2) + " %"; }
}  // namespace

std::string to_markdown(const RestorationError& e) {
  const auto hole = static_cast<double>(e.hole_pixels);
  std::vector<TableRow> rows{
      {"inside the holes", "value"},
      {"pictures, of them with a hole", std::to_string(e.pictures) + ", " + std::to_string(e.with_hole)},
      {"holes, share of the picture", percent(share(hole, static_cast<double>(e.pixels)))},
      {"seen at another time, invented", percent(share(static_cast<double>(e.reprojected_pixels), hole)) +
                                             ", " +
                                             percent(share(static_cast<double>(e.invented_pixels), hole))},
      {"PSNR", fixed(e.psnr, 2) + " dB"},
      {"SSIM", fixed(e.ssim, 4)},
      {"mean absolute error", fixed(e.l1, 2) + " grey levels"},
      {"PSNR of what was seen, invented",
       fixed(e.psnr_reprojected, 2) + ", " + fixed(e.psnr_invented, 2) + " dB"},
      {"depth error of what was seen, invented (median)",
       percent(e.depth_error_reprojected) + ", " + percent(e.depth_error_invented)},
      {"true depths that have one", percent(e.depth_known)},
      {"ORB points, in the truth", std::to_string(e.points) + ", " + std::to_string(e.true_points)},
      {"true ORB points found again",
       percent(share(static_cast<double>(e.matched_points), static_cast<double>(e.true_points)))},
      {"invented pixels taken for what may move", percent(e.movable_share)},
  };
  return (e.interrupted ? "Interrupted: of the pictures compared so far\n\n" : "") + markdown_table(rows);
}

std::string to_json(const RestorationError& e) {
  const auto hole = static_cast<double>(e.hole_pixels);
  const nlohmann::ordered_json json{
      {"interrupted", e.interrupted},
      {"pictures", e.pictures},
      {"pictures_with_hole", e.with_hole},
      {"hole_share", number(share(hole, static_cast<double>(e.pixels)))},
      {"reprojected_share", number(share(static_cast<double>(e.reprojected_pixels), hole))},
      {"invented_share", number(share(static_cast<double>(e.invented_pixels), hole))},
      {"psnr_db", number(e.psnr)},
      {"ssim", number(e.ssim)},
      {"l1_grey_levels", number(e.l1)},
      {"psnr_reprojected_db", number(e.psnr_reprojected)},
      {"psnr_invented_db", number(e.psnr_invented)},
      {"depth_error_reprojected", number(e.depth_error_reprojected)},
      {"depth_error_invented", number(e.depth_error_invented)},
      {"depth_known_share", number(e.depth_known)},
      {"orb_points", e.points},
      {"orb_points_in_truth", e.true_points},
      {"orb_points_found_again", e.matched_points},
      {"movable_share_of_invented", number(e.movable_share)}};
  return json.dump() + "\n";
}

}  // namespace roslam
