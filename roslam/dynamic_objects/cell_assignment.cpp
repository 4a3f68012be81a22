// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/cell_assignment.hpp"

#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "roslam/common/widened.hpp"
#include "roslam/dynamic_objects/mask_refinement.hpp"

namespace roslam {

namespace {
bool is_fresh(const MovableObject& object) { return object.misses == 0 && object.kind != Movable::kUnknown; }

cv::Mat square(int pixels) {
  return cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1});
}
}  // namespace

void assign_cells(CellScene& scene, const std::vector<MovableObject>& objects,
                  const std::vector<MovableObject>& propagated, const CellGrid& grid,
                  const DynamicObjectOptions& options) {
  enum class Rule { kAll, kPlausible, kMoving };  // which cells under its mask an object gets
  const auto allows = [&](Rule rule, const cv::Point& cell, float median_depth) {
    const auto state = static_cast<MotionEvidence>(scene.depth_evidence.state.at<std::uint8_t>(cell));
    if (rule == Rule::kAll || state == MotionEvidence::kMoving) return true;
    constexpr float kReach = 0.35F;  // metres in depth that an object may extend from its median
    const float z = scene.depth.at<float>(cell);
    return rule == Rule::kPlausible && state == MotionEvidence::kUnknown && z > 0.0F &&
           std::abs(z - median_depth) < kReach;
  };
  const auto assign = [&](const MovableObject& object, std::size_t index, Rule rule) {
    const cv::Point begin = grid.cell_of(object.box.tl());
    const cv::Point end = grid.cell_of(object.box.br());
    for (int y = begin.y; y <= end.y; ++y) {
      for (int x = begin.x; x <= end.x; ++x) {
        const cv::Point pixel = grid.pixel_of({x, y});
        if (!object.box.contains(pixel) || object.mask.at<std::uint8_t>(pixel - object.box.tl()) == 0)
          continue;
        int& owner = scene.owners.at<int>(y, x);
        if (owner == 0 && allows(rule, {x, y}, object.median_depth)) owner = static_cast<int>(index) + 1;
      }
    }
  };
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (is_fresh(objects[i])) assign(objects[i], i, Rule::kAll);
  }
  scene.seeds |= scene.owners != 0;
  const bool has_depth = options.depth_consistency;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (is_fresh(objects[i]) || !is_seen_repeatedly(objects[i])) continue;
    assign(objects[i], i, has_depth ? Rule::kPlausible : Rule::kAll);
  }
  if (!has_depth) return;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (const auto& past : propagated) {
      if (past.id == objects[i].id && past.is_confirmed && is_seen_repeatedly(past))
        assign(past, i, Rule::kMoving);
    }
  }
}

PixelOwners owners_of_pixels(const CellScene& scene, const std::vector<MovableObject>& objects,
                             const cv::Mat& depth, const CellGrid& grid,
                             const DynamicObjectOptions& options) {
  cv::Mat cells;
  scene.owners.convertTo(cells, CV_16U);
  // The network's masks have finer borders than cells.
  const auto has_fine_mask = [&](const MovableObject& object) {
    return object.is_confirmed && is_seen_repeatedly(object) &&
           (is_fresh(object) || !options.depth_consistency);
  };
  cv::Rect owned = cv::boundingRect(scene.owners != 0);
  for (const MovableObject& object : objects) {
    if (has_fine_mask(object)) owned |= grid.cells_of(object.box);
  }
  if (owned.empty()) return {};
  const int reach = options.edge_band / grid.side() + 1;  // cells
  const cv::Rect around = widened(owned, reach) & cv::Rect({0, 0}, grid.size());
  PixelOwners result{grid.pixels_of(around), grid.in_pixels(cells(around), around)};
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!has_fine_mask(objects[i])) continue;
    cv::Mat box = result.owners(objects[i].box - result.area.tl());
    box.setTo(static_cast<int>(i) + 1, objects[i].mask & (box == 0));
  }
  if (!options.refine) return result;
  // Only masks with evidence of this frame may grow, or propagated ones would grow with every frame.
  cv::Mat near_seeds;
  cv::dilate(scene.seeds, near_seeds, square(reach));
  const cv::Mat barrier = scene.cells_that_are(MotionEvidence::kStatic) | (near_seeds == 0);
  const cv::Mat mask =
      refine_mask(result.owners != 0, depth, scene.depth, barrier, grid, options.edge_band, result.area.tl());
  // What is added to the masks belongs to an object nearby.
  cv::dilate(cells, cells, square(reach));
  for (int y = 0; y < mask.rows; ++y) {
    const auto* is_set = mask.ptr<std::uint8_t>(y);
    const auto* nearby = cells.ptr<std::uint16_t>((result.area.y + y) / grid.side());
    auto* owner = result.owners.ptr<std::uint16_t>(y);
    for (int x = 0; x < mask.cols; ++x) {
      if (is_set[x] == 0)
        owner[x] = 0;
      else if (owner[x] == 0)
        owner[x] = nearby[(result.area.x + x) / grid.side()];
    }
  }
  return result;
}

}  // namespace roslam
