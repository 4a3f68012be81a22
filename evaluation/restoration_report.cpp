// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/restoration_error.hpp"

namespace roslam::evaluation {

namespace {
double share(double part, double all) { return part / all; }  // NaN for 0 / 0

std::string percent(double value) { return fixed(100.0 * value, 2) + " %"; }
}  // namespace

std::string to_markdown(const RestorationError& e) {
  const auto hole = static_cast<double>(e.hole_pixels);
  std::vector<TableRow> rows{
      {"inside the holes", "value"},
      {"images, those with a hole", std::to_string(e.images) + ", " + std::to_string(e.with_hole)},
      {"holes, share of the image", percent(share(hole, static_cast<double>(e.pixels)))},
      {"reprojected, inpainted", percent(share(static_cast<double>(e.reprojected_pixels), hole)) + ", " +
                                     percent(share(static_cast<double>(e.inpainted_pixels), hole))},
      {"PSNR", fixed(e.psnr, 2) + " dB"},
      {"SSIM", fixed(e.ssim, 4)},
      {"mean absolute error", fixed(e.l1, 2) + " grey levels"},
      {"PSNR of reprojected, inpainted pixels",
       fixed(e.psnr_reprojected, 2) + ", " + fixed(e.psnr_inpainted, 2) + " dB"},
      {"median depth error of reprojected, inpainted pixels",
       percent(e.depth_error_reprojected) + ", " + percent(e.depth_error_inpainted)},
      {"pixels of known true depth with an estimate", percent(e.depth_known)},
      {"ORB points, in the true images", std::to_string(e.points) + ", " + std::to_string(e.true_points)},
      {"true ORB points matched",
       percent(share(static_cast<double>(e.matched_points), static_cast<double>(e.true_points)))},
      {"inpainted pixels labelled as movable", percent(e.movable_share)},
  };
  return (e.interrupted ? "Interrupted: of the images compared so far\n\n" : "") + markdown_table(rows);
}

std::string to_json(const RestorationError& e) {
  const auto hole = static_cast<double>(e.hole_pixels);
  const nlohmann::ordered_json json{
      {"interrupted", e.interrupted},
      {"images", e.images},
      {"pictures_with_hole", e.with_hole},
      {"hole_share", number(share(hole, static_cast<double>(e.pixels)))},
      {"reprojected_share", number(share(static_cast<double>(e.reprojected_pixels), hole))},
      {"inpainted_share", number(share(static_cast<double>(e.inpainted_pixels), hole))},
      {"psnr_db", number(e.psnr)},
      {"ssim", number(e.ssim)},
      {"l1_grey_levels", number(e.l1)},
      {"psnr_reprojected_db", number(e.psnr_reprojected)},
      {"psnr_inpainted_db", number(e.psnr_inpainted)},
      {"depth_error_reprojected", number(e.depth_error_reprojected)},
      {"depth_error_inpainted", number(e.depth_error_inpainted)},
      {"depth_known_share", number(e.depth_known)},
      {"orb_points", e.points},
      {"orb_points_in_truth", e.true_points},
      {"orb_points_found_again", e.matched_points},
      {"movable_share_of_inpainted", number(e.movable_share)}};
  return json.dump() + "\n";
}

}  // namespace roslam::evaluation
