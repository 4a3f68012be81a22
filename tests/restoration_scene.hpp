// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "roslam/dynamic_objects/mask_refinement.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "tests/dynamic_scene.hpp"

/// Images of the scenes of dynamic_scene.hpp with an object in them that is removed.
namespace roslam::scene {

/// Occludes parts of wall, shelf and bench.
constexpr Panel kPerson{-0.3, -0.6, 0.2, 0.9, 1.3};

inline cv::Mat in_colour(const cv::Mat& grey) {
  cv::Mat dim, colour;
  grey.convertTo(dim, CV_8U, 0.6, 30.0);
  cv::merge(std::vector<cv::Mat>{dim, grey, 255 - grey}, colour);
  return colour;
}

/// Renders the panels; the object kThing, if there is one, is removed with a margin.
inline roslam::PosedImage taken(const Stage& stage, const std::vector<Panel>& panels,
                                const SE3& T_camera_world, double timestamp) {
  const View seen = stage.show(panels, T_camera_world);
  return {timestamp, T_camera_world.inverse(), in_colour(seen.grey), seen.depth,
          dilated(seen.shows(kThing), 4)};
}

/// Mean absolute difference of images where a mask is set, grey levels.
inline double difference(const cv::Mat& a, const cv::Mat& b, const cv::Mat& where) {
  return cv::norm(a, b, cv::NORM_L1, where) / (a.channels() * std::max(1, cv::countNonZero(where)));
}

/// Largest relative difference of depths where a mask is set.
inline double depth_difference(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where) {
  double largest = 0.0;
  const cv::Mat share = cv::abs(estimate - truth) / truth;
  cv::minMaxLoc(share, nullptr, &largest, nullptr, nullptr, where);
  return largest;
}

}  // namespace roslam::scene
