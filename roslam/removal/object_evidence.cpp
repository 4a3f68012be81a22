// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/object_evidence.hpp"

namespace roslam {

namespace {
constexpr float kBriefly = 0.3F;      // seconds
constexpr double kMostlyKnown = 0.4;  // share of a thing that earlier frames must have seen to tell
}  // namespace

std::vector<ObjectEvidence> evidence_by_owner(const cv::Mat& owners, std::size_t count,
                                              const FreeSpaceEvidence& space, const FollowedPoints& flow,
                                              const CellGrid& grid, const RemovalOptions& options) {
  std::vector<ObjectEvidence> result(count + 1);
  const auto rest = static_cast<float>(options.rest);
  for (int y = 0; y < owners.rows; ++y) {
    for (int x = 0; x < owners.cols; ++x) {
      ObjectEvidence& evidence = result[static_cast<std::size_t>(owners.at<int>(y, x))];
      const auto state = static_cast<Evidence>(space.state.at<std::uint8_t>(y, x));
      const float age = space.static_for.at<float>(y, x);
      ++evidence.cells;
      if (state == Evidence::kUnknown) continue;
      ++evidence.known;
      if (state == Evidence::kMoving) ++evidence.moving;
      if (state == Evidence::kStatic && age >= kBriefly) ++evidence.at_rest_briefly;
      if (state == Evidence::kStatic && age >= rest) ++evidence.at_rest_long;
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

bool rests(const ObjectEvidence& e, const RemovalOptions& options) {
  constexpr double kAtRest = 0.9;  // of what is known
  constexpr double kMoving = 0.05;
  const bool flow_agrees =
      !options.flow || !e.is_flow_fine || e.flow_moving <= kMoving * (e.flow_moving + e.flow_at_rest);
  return e.cells > 0 && e.known >= kMostlyKnown * e.cells && e.at_rest_long >= kAtRest * e.known &&
         e.moving <= kMoving * e.known && flow_agrees;
}

bool seems_at_rest(const ObjectEvidence& e, const RemovalOptions& options) {
  constexpr int kEnough = 5;  // points
  constexpr double kFewMoving = 0.1;
  const int followed = e.flow_moving + e.flow_at_rest;
  const bool flow_agrees =
      e.is_flow_fine && e.flow_at_rest >= kEnough && e.flow_moving <= kFewMoving * followed;
  constexpr double kAtRest = 0.8;  // of what is known
  constexpr double kMoving = 0.05;
  const bool depth_agrees = e.cells > 0 && e.known >= kMostlyKnown * e.cells &&
                            e.at_rest_briefly >= kAtRest * e.known && e.moving <= kMoving * e.known;
  return (flow_agrees || !options.flow) && (depth_agrees || !options.free_space);
}

bool contradicts_motion(const ObjectEvidence& e) {
  constexpr int kEnough = 4;  // points
  constexpr double kFewMoving = 0.2;
  return e.flow_at_rest >= kEnough && e.flow_moving <= kFewMoving * (e.flow_moving + e.flow_at_rest);
}

}  // namespace roslam
