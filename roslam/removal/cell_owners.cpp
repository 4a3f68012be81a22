// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/cell_owners.hpp"

#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "roslam/removal/mask_refinement.hpp"

namespace roslam {

namespace {
bool is_fresh(const MovableObject& object) { return object.misses == 0 && object.kind != Movable::kUnknown; }

cv::Mat square(int pixels) {
  return cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1});
}
}  // namespace

void claim_cells(CellScene& scene, const std::vector<MovableObject>& objects,
                 const std::vector<MovableObject>& before, const CellGrid& grid,
                 const RemovalOptions& options) {
  enum class Claim { kAll, kPlausible, kMoving };
  const auto allows = [&](Claim claim, const cv::Point& cell, float middle) {
    const auto state = static_cast<Evidence>(scene.space.state.at<std::uint8_t>(cell));
    if (claim == Claim::kAll || state == Evidence::kMoving) return true;
    constexpr float kReach = 0.35F;  // metres in depth that a thing may extend from its middle
    const float z = scene.depth.at<float>(cell);
    return claim == Claim::kPlausible && state == Evidence::kUnknown && z > 0.0F &&
           std::abs(z - middle) < kReach;
  };
  const auto claim_for = [&](const MovableObject& object, std::size_t index, Claim claim) {
    const cv::Point begin = grid.cell_of(object.box.tl());
    const cv::Point end = grid.cell_of(object.box.br());
    for (int y = begin.y; y <= end.y; ++y) {
      for (int x = begin.x; x <= end.x; ++x) {
        const cv::Point pixel = grid.pixel_of({x, y});
        if (!object.box.contains(pixel) || object.mask.at<std::uint8_t>(pixel - object.box.tl()) == 0)
          continue;
        int& owner = scene.owners.at<int>(y, x);
        if (owner == 0 && allows(claim, {x, y}, object.median_depth)) owner = static_cast<int>(index) + 1;
      }
    }
  };
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (is_fresh(objects[i])) claim_for(objects[i], i, Claim::kAll);
  }
  scene.seeds |= scene.owners != 0;
  const bool has_depth = options.free_space;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (is_fresh(objects[i]) || !is_confirmed(objects[i])) continue;
    claim_for(objects[i], i, has_depth ? Claim::kPlausible : Claim::kAll);
  }
  if (!has_depth) return;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (const auto& past : before) {
      if (past.id == objects[i].id && past.is_believed && is_confirmed(past))
        claim_for(past, i, Claim::kMoving);
    }
  }
}

cv::Mat owners_of_pixels(const CellScene& scene, const std::vector<MovableObject>& objects,
                         const cv::Mat& depth, const CellGrid& grid, const RemovalOptions& options) {
  cv::Mat cells;
  scene.owners.convertTo(cells, CV_16U);
  cv::Mat owners = grid.in_pixels(cells);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    // The network draws finer borders than cells have.
    if (!objects[i].is_believed || !is_confirmed(objects[i])) continue;
    if (!is_fresh(objects[i]) && options.free_space) continue;
    cv::Mat view = owners(objects[i].box);
    view.setTo(static_cast<int>(i) + 1, objects[i].mask & (view == 0));
  }
  if (!options.refine) return owners;
  // Nothing is added to what only was there before, or it would grow with every frame.
  cv::Mat near_seeds;
  cv::dilate(scene.seeds, near_seeds, square(options.edge_band / grid.side() + 1));
  const cv::Mat barrier = scene.cells_that_are(Evidence::kStatic) | (near_seeds == 0);
  const cv::Mat mask = refine_mask(owners != 0, depth, scene.depth, barrier, grid, options.edge_band);
  cv::Mat wider;
  cv::dilate(owners, wider, square(options.edge_band));
  wider.copyTo(owners, owners == 0);
  owners.setTo(0, mask == 0);
  return owners;
}

}  // namespace roslam
