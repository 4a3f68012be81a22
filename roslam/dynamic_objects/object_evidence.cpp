// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/object_evidence.hpp"

namespace roslam {

namespace {
constexpr float kBriefly = 0.3F;      // seconds
constexpr double kMostlyKnown = 0.4;  // share of the cells with evidence that a decision needs
}  // namespace

std::vector<ObjectEvidence> evidence_by_owner(const cv::Mat& owners, std::size_t count,
                                              const DepthEvidence& depth, const TrackedPoints& flow,
                                              const CellGrid& grid, const DynamicObjectOptions& options) {
  std::vector<ObjectEvidence> result(count + 1);
  const auto rest = static_cast<float>(options.rest);
  for (int y = 0; y < owners.rows; ++y) {
    for (int x = 0; x < owners.cols; ++x) {
      ObjectEvidence& evidence = result[static_cast<std::size_t>(owners.at<int>(y, x))];
      const auto state = static_cast<MotionEvidence>(depth.state.at<std::uint8_t>(y, x));
      const float age = depth.static_for.at<float>(y, x);
      ++evidence.cells;
      if (state == MotionEvidence::kUnknown) continue;
      ++evidence.known;
      if (state == MotionEvidence::kMoving) ++evidence.moving;
      if (state == MotionEvidence::kStatic && age >= kBriefly) ++evidence.at_rest_briefly;
      if (state == MotionEvidence::kStatic && age >= rest) ++evidence.at_rest_long;
    }
  }
  const auto owner_of = [&](const cv::Point2f& point) {
    return static_cast<std::size_t>(owners.at<int>(grid.cell_of(point)));
  };
  for (const auto& point : flow.moving) ++result[owner_of(point)].flow_moving;
  constexpr double kFine = 2.5;  // pixels
  for (auto& evidence : result) evidence.is_flow_fine = flow.sigma <= kFine;
  for (const auto& point : flow.at_rest) ++result[owner_of(point)].flow_at_rest;
  return result;
}

bool has_rested(const ObjectEvidence& e, const DynamicObjectOptions& options) {
  constexpr double kAtRest = 0.9;  // of what is known
  constexpr double kMoving = 0.05;
  const bool flow_agrees =
      !options.flow || !e.is_flow_fine || e.flow_moving <= kMoving * (e.flow_moving + e.flow_at_rest);
  return e.cells > 0 && e.known >= kMostlyKnown * e.cells && e.at_rest_long >= kAtRest * e.known &&
         e.moving <= kMoving * e.known && flow_agrees;
}

bool seems_at_rest(const ObjectEvidence& e, const DynamicObjectOptions& options) {
  constexpr int kEnough = 5;  // points
  constexpr double kFewMoving = 0.1;
  const int tracked = e.flow_moving + e.flow_at_rest;
  const bool flow_agrees =
      e.is_flow_fine && e.flow_at_rest >= kEnough && e.flow_moving <= kFewMoving * tracked;
  constexpr double kAtRest = 0.8;  // of what is known
  constexpr double kMoving = 0.05;
  const bool depth_agrees = e.cells > 0 && e.known >= kMostlyKnown * e.cells &&
                            e.at_rest_briefly >= kAtRest * e.known && e.moving <= kMoving * e.known;
  return (flow_agrees || !options.flow) && (depth_agrees || !options.depth_consistency);
}

bool contradicts_motion(const ObjectEvidence& e) {
  constexpr int kEnough = 4;  // points
  constexpr double kFewMoving = 0.2;
  return e.flow_at_rest >= kEnough && e.flow_moving <= kFewMoving * (e.flow_moving + e.flow_at_rest);
}

}  // namespace roslam
