// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam::scene {

inline SE3 pose(double x, double y, double turn) {
  return SE3::exp((Vector6d() << x, y, 0.1 * x, 0.0, turn, 0.02).finished());
}

inline void expect_same(const SE3& a, const SE3& b) { EXPECT_LT((a.matrix() - b.matrix()).norm(), 1e-9); }

// Keyframes anywhere, that share as many landmarks as a test says.
class MapOfKeyframes : public testing::Test {
 protected:
  static constexpr std::size_t kPoints = 300;

  KeyframeId add_keyframe(SubmapId submap = SubmapId{0}) {
    auto view = std::make_shared<ObservedFrame>();
    view->pixels.resize(kPoints, Eigen::Vector2f::Zero());
    view->depths.resize(kPoints, 2.0F);
    view->levels.resize(kPoints, 0);
    view->angles.resize(kPoints, 0.0F);
    view->colours.resize(kPoints);
    view->descriptors.resize(kPoints);
    next_point_.push_back(0);
    const auto i = static_cast<double>(map_.keyframe_slots());
    return map_.add_keyframe(map_.keyframe_slots(), i, pose(0.3 * i, std::sin(i), 0.1 * i), view, submap);
  }

  std::vector<KeyframeId> add_keyframes(int count) {
    std::vector<KeyframeId> result;
    for (int i = 0; i < count; ++i) result.push_back(add_keyframe());
    return result;
  }

  // Landmarks that exactly these keyframes see.
  std::vector<LandmarkId> add_landmarks(int count, const std::vector<KeyframeId>& observers) {
    std::vector<LandmarkId> result;
    for (int i = 0; i < count; ++i) {
      const KeyframeId first = observers.front();
      const Eigen::Vector3d in_camera(0.1 * i, 0.2, 2.0);
      result.push_back(map_.add_landmark(map_.find(first)->T_camera_world.inverse() * in_camera, first,
                                         next_point_[first.index()]++));
      for (std::size_t k = 1; k < observers.size(); ++k)
        map_.add_observation(result.back(), observers[k], next_point_[observers[k].index()]++);
    }
    return result;
  }

  SE3 relative(KeyframeId to, KeyframeId from) const {
    return map_.T_camera_world(to) * map_.T_camera_world(from).inverse();
  }

  Map map_{{1.0F, 1.2F}};
  MapMutex mutex_;
  std::vector<std::uint32_t> next_point_;
};

}  // namespace roslam::scene
