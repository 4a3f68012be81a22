// SPDX-License-Identifier: BSD-3-Clause
// Duplicate landmarks in maps of known points.
#include "roslam/mapping/fusion.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <set>

namespace roslam {
namespace {

// A physical point.
struct Point {
  Eigen::Vector3d position;  // world, metres
  Descriptor descriptor;
};

class Fusion : public testing::Test {
 protected:
  static constexpr std::size_t kShared = 10;  // points whose landmark all keyframes see
  static constexpr std::size_t kPoints = 30;

  Fusion() {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    while (points_.size() < kPoints)
      points_.push_back(
          {{uniform(random_), 0.8 * uniform(random_), 3.0 + 0.5 * uniform(random_)}, descriptor()});
  }

  Descriptor descriptor() { return {random_(), random_(), random_(), random_()}; }

  // A keyframe that looks along z from there and sees all these points, without landmarks.
  KeyframeId add_keyframe(double x, const std::vector<Point>& points) {
    const SE3 T_camera_world(Eigen::Quaterniond::Identity(), {-x, 0.0, 0.0});
    auto view = std::make_shared<ObservedFrame>();
    for (const Point& point : points) {
      const Eigen::Vector3d in_camera = T_camera_world * point.position;
      view->pixels.push_back(camera_.project(in_camera).cast<float>());
      view->depths.push_back(static_cast<float>(in_camera.z()));
      view->levels.push_back(0);
      view->angles.push_back(0.0F);
      view->colours.emplace_back(0, 0, 0);
      view->descriptors.push_back(point.descriptor);
    }
    view->grid = FeatureGrid(view->pixels, {0.0, 0.0, 640.0, 480.0});
    return map_.add_keyframe(map_.keyframe_slots(), 0.1 * static_cast<double>(map_.keyframe_slots()),
                             T_camera_world, view);
  }

  // A landmark of its own for one point of the keyframe.
  LandmarkId add_landmark(KeyframeId keyframe, std::size_t point) {
    const Keyframe& seen = *map_.find(keyframe);
    const auto index = static_cast<std::uint32_t>(point);
    const Eigen::Vector3d in_camera =
        camera_.unproject(seen.view->pixels[point].cast<double>(), seen.view->depths[point]);
    return map_.add_landmark(seen.T_camera_world.inverse() * in_camera, keyframe, index);
  }

  // The first points become landmarks that both see, so that the keyframes are covisible.
  void share(KeyframeId a, KeyframeId b) {
    for (std::uint32_t i = 0; i < kShared; ++i) {
      const LandmarkId known = map_.find(a)->landmarks[i];
      map_.add_observation(known.is_valid() ? known : add_landmark(a, i), b, i);
    }
  }

  int fuse(KeyframeId keyframe, const FusionOptions& options = {}) {
    return fuse_landmarks(map_, mutex_, keyframe, camera_, noise_, {}, options);
  }

  // Both sides of every observation agree, and no keyframe sees a landmark twice.
  void expect_consistent() const {
    std::size_t observations = 0;
    for (const LandmarkId id : map_.landmark_ids()) {
      std::set<KeyframeId> observers;
      for (const Observation& observation : map_.find(id)->observations) {
        EXPECT_TRUE(observers.insert(observation.keyframe).second) << "landmark " << id.value;
        EXPECT_EQ(map_.find(observation.keyframe)->landmarks[observation.point], id);
        ++observations;
      }
    }
    for (const KeyframeId id : map_.keyframe_ids()) {
      for (const LandmarkId landmark : map_.find(id)->landmarks) {
        if (!landmark.is_valid()) continue;
        EXPECT_NE(map_.find(landmark), nullptr);
        --observations;
      }
    }
    EXPECT_EQ(observations, 0U);
  }

  std::mt19937_64 random_{5};
  Camera camera_;
  MeasurementNoise noise_;
  Map map_{{1.0F, 1.2F, 1.44F}};
  MapMutex mutex_;
  std::vector<Point> points_;
};

TEST_F(Fusion, MakesOneLandmarkOfDuplicates) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.3, points_);
  share(a, b);
  std::vector<LandmarkId> of_a;
  std::vector<LandmarkId> of_b;
  for (std::size_t i = kShared; i < kPoints; ++i) {
    of_a.push_back(add_landmark(a, i));
    of_b.push_back(add_landmark(b, i));
  }
  ASSERT_EQ(map_.landmark_count(), kShared + of_a.size() + of_b.size());
  EXPECT_EQ(fuse(b), static_cast<int>(of_a.size()));
  EXPECT_EQ(map_.landmark_count(), kPoints);
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    const LandmarkId kept = map_.find(a)->landmarks[kShared + i];
    EXPECT_EQ(map_.find(b)->landmarks[kShared + i], kept);
    EXPECT_EQ(map_.resolve(of_a[i]), kept);
    EXPECT_EQ(map_.resolve(of_b[i]), kept);
    ASSERT_NE(map_.find(kept), nullptr);
    EXPECT_EQ(map_.find(kept)->observations.size(), 2U);
  }
  expect_consistent();
  EXPECT_EQ(fuse(b), 0) << "nothing is left to fuse";
}

TEST_F(Fusion, AddsObservationsOfPointsWithoutALandmark) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.3, points_);
  share(a, b);
  for (std::size_t i = kShared; i < kPoints; ++i) add_landmark(i % 2 == 0 ? a : b, i);
  EXPECT_EQ(fuse(b), 0) << "nothing is merged";
  EXPECT_EQ(map_.landmark_count(), kPoints);
  for (const LandmarkId id : map_.landmark_ids()) EXPECT_EQ(map_.find(id)->observations.size(), 2U);
  for (std::size_t i = 0; i < kPoints; ++i)
    EXPECT_EQ(map_.find(a)->landmarks[i], map_.find(b)->landmarks[i]) << i;
  expect_consistent();
}

TEST_F(Fusion, KeepsTheLandmarkThatMoreKeyframesSee) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.2, points_);
  const KeyframeId c = add_keyframe(0.3, points_);
  share(a, b);
  share(a, c);
  const LandmarkId seen_once = add_landmark(a, kShared);
  const LandmarkId seen_twice = add_landmark(b, kShared);
  map_.add_observation(seen_twice, c, kShared);
  EXPECT_EQ(fuse(a), 1);
  EXPECT_EQ(map_.find(seen_once), nullptr);
  ASSERT_EQ(map_.resolve(seen_once), seen_twice);
  ASSERT_NE(map_.find(seen_twice), nullptr);
  EXPECT_EQ(map_.find(seen_twice)->observations.size(), 3U);
  expect_consistent();
}

// Two keyframes, one of which sees the last point as `theirs`. How many are merged.
class FusionOfOnePoint : public Fusion {
 protected:
  int merged_with(const Point& theirs) {
    map_ = Map({1.0F, 1.2F, 1.44F});
    const KeyframeId a = add_keyframe(0.0, points_);
    std::vector<Point> seen = points_;
    seen.back() = theirs;
    const KeyframeId b = add_keyframe(0.3, seen);
    share(a, b);
    const LandmarkId of_a = add_landmark(a, kPoints - 1);
    const LandmarkId of_b = add_landmark(b, kPoints - 1);
    const int merged = fuse(b);
    EXPECT_EQ(map_.resolve(of_a) == map_.resolve(of_b), merged > 0);
    EXPECT_EQ(map_.landmark_count(), kShared + (merged > 0 ? 1 : 2));
    expect_consistent();
    return merged;
  }
};

TEST_F(FusionOfOnePoint, PointsThatLieApartStayApart) {
  Point theirs = points_.back();
  EXPECT_EQ(merged_with(theirs), 1);
  theirs.position.y() += 0.003;  // half a pixel
  EXPECT_EQ(merged_with(theirs), 1);
  theirs.position.y() += 0.1;  // 17 pixels
  EXPECT_EQ(merged_with(theirs), 0);
}

// On one viewing ray of the second keyframe, so that only depth tells them apart there.
TEST_F(FusionOfOnePoint, PointsAtDifferentDepthsStayApart) {
  const Eigen::Vector3d centre(0.3, 0.0, 0.0);
  Point theirs = points_.back();
  theirs.position = centre + 1.001 * (points_.back().position - centre);
  EXPECT_EQ(merged_with(theirs), 1);
  theirs.position = centre + 1.2 * (points_.back().position - centre);
  EXPECT_EQ(merged_with(theirs), 0);
}

TEST_F(FusionOfOnePoint, PointsThatLookDifferentStayApart) {
  Point theirs = points_.back();
  const auto with_flipped = [&](int bits) {
    Point flipped = theirs;
    for (int i = 0; i < bits; ++i)
      flipped.descriptor[static_cast<std::size_t>(i % 4)] ^= std::uint64_t{1} << (i / 4);
    return flipped;
  };
  const MatcherOptions matcher;
  EXPECT_EQ(merged_with(with_flipped(matcher.strict_distance)), 1);
  EXPECT_EQ(merged_with(with_flipped(matcher.strict_distance + 1)), 0);
}

// One physical point that a keyframe has two landmarks of, where only one of them can be merged.
TEST_F(Fusion, NoKeyframeSeesALandmarkTwice) {
  const KeyframeId a = add_keyframe(0.0, points_);
  std::vector<Point> seen_twice = points_;
  seen_twice.push_back(points_.back());
  seen_twice.back().position.x() += 0.002;
  const KeyframeId b = add_keyframe(0.3, seen_twice);
  share(a, b);
  const LandmarkId of_a = add_landmark(a, kPoints - 1);
  const LandmarkId first_of_b = add_landmark(b, kPoints - 1);
  const LandmarkId second_of_b = add_landmark(b, kPoints);
  EXPECT_EQ(fuse(b), 2);
  EXPECT_EQ(map_.resolve(first_of_b), map_.resolve(of_a));
  EXPECT_EQ(map_.resolve(second_of_b), map_.resolve(of_a));
  const Landmark* kept = map_.find(map_.resolve(of_a));
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->observations.size(), 2U);
  EXPECT_NE(map_.find(b)->landmarks[kPoints - 1].is_valid(), map_.find(b)->landmarks[kPoints].is_valid());
  expect_consistent();
}

TEST_F(Fusion, ForwardingFollowsRepeatedMerging) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.2, points_);
  const KeyframeId c = add_keyframe(0.3, points_);
  share(a, b);
  share(a, c);
  const std::vector<LandmarkId> duplicates{add_landmark(a, kShared), add_landmark(b, kShared),
                                           add_landmark(c, kShared)};
  EXPECT_EQ(fuse(c), 2);
  const LandmarkId kept = map_.find(c)->landmarks[kShared];
  ASSERT_NE(map_.find(kept), nullptr);
  EXPECT_EQ(map_.find(kept)->observations.size(), 3U);
  for (const LandmarkId id : duplicates) EXPECT_EQ(map_.resolve(id), kept);
  expect_consistent();
}

// The first and the last of three keyframes share nothing, but both share landmarks with the second.
TEST_F(Fusion, ReachesTheNeighboursOfNeighbours) {
  for (const int second_neighbours : {0, 5}) {
    map_ = Map({1.0F, 1.2F, 1.44F});
    const KeyframeId a = add_keyframe(0.0, points_);
    const KeyframeId b = add_keyframe(0.2, points_);
    const KeyframeId c = add_keyframe(0.3, points_);
    map_.add_observation(add_landmark(a, 0), b, 0);
    map_.add_observation(add_landmark(c, 1), b, 1);
    ASSERT_EQ(map_.covisible(a).size(), 1U);
    const LandmarkId of_a = add_landmark(a, kPoints - 1);
    const LandmarkId of_c = add_landmark(c, kPoints - 1);
    // The point looks different from b, so that the landmarks of a and c do not meet there.
    std::const_pointer_cast<ObservedFrame>(map_.find(b)->view)->descriptors.back() = descriptor();
    EXPECT_EQ(fuse(a, {.neighbours = 10, .second_neighbours = second_neighbours}),
              second_neighbours > 0 ? 1 : 0);
    EXPECT_EQ(map_.resolve(of_a) == map_.resolve(of_c), second_neighbours > 0);
    expect_consistent();
  }
}

TEST_F(Fusion, ReachesNoneWithoutNeighbours) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.3, points_);
  share(a, b);
  add_landmark(a, kPoints - 1);
  add_landmark(b, kPoints - 1);
  EXPECT_EQ(fuse(a, {.neighbours = 0}), 0);
  EXPECT_EQ(fuse(a), 1);
}

// Points on movable objects at rest are used for poses and never mapped.
TEST_F(Fusion, GivesNoLandmarkToAPointOnAMovableObject) {
  const KeyframeId a = add_keyframe(0.0, points_);
  const KeyframeId b = add_keyframe(0.3, points_);
  share(a, b);
  const LandmarkId of_a = add_landmark(a, kPoints - 1);
  const LandmarkId static_of_a = add_landmark(a, kPoints - 2);
  auto view = std::const_pointer_cast<ObservedFrame>(map_.find(b)->view);
  view->is_movable.assign(view->size(), false);
  view->is_movable[kPoints - 1] = true;
  fuse(b);
  EXPECT_EQ(map_.find(b)->landmarks[kPoints - 2], static_of_a);
  EXPECT_FALSE(map_.find(b)->landmarks[kPoints - 1].is_valid());
  EXPECT_EQ(map_.find(of_a)->observations.size(), 1U);
}

}  // namespace
}  // namespace roslam
