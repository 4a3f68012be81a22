// SPDX-License-Identifier: BSD-3-Clause
// New landmarks from known geometry: by depth, and by two views.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "roslam/mapping/new_landmarks.hpp"

namespace roslam {
namespace {

TEST(TwoRays, MeetInTheirCrossing) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d point = 5.0 * vector();
    const Eigen::Vector3d a = vector();
    const Eigen::Vector3d b = vector();
    const auto found = triangulate(a, 0.3 * (point - a), b, 7.0 * (point - b));
    ASSERT_TRUE(found);
    EXPECT_LT((*found - point).norm(), 1e-8);
  }
}

TEST(TwoRays, ThatMissEachOtherMeetInTheMiddle) {
  const auto found = triangulate({0, 0, 0}, {0, 0, 1}, {1, 0.1, 2}, {-1, 0, 0});
  ASSERT_TRUE(found);
  EXPECT_LT((*found - Eigen::Vector3d(0, 0.05, 2)).norm(), 1e-12);
}

TEST(TwoRays, MayCrossBehindTheirOrigins) {
  const auto found = triangulate({0, 0, 0}, {-1, 0, 2}, {1, 0, 0}, {1, 0, 2});
  ASSERT_TRUE(found);
  EXPECT_LT((*found - Eigen::Vector3d(0.5, 0, -1)).norm(), 1e-12);
}

TEST(TwoRays, ThatAreParallelDoNotMeet) {
  EXPECT_FALSE(triangulate({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, 3}));
  EXPECT_FALSE(triangulate({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, -3}));
  EXPECT_TRUE(triangulate({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0.001, 0, 1}));
}

// The points of a view at that pose.
struct Point {
  Eigen::Vector3d in_camera;  // metres
  Descriptor descriptor{};
  float depth = 0.0F;  // as measured, metres; 0: unknown
  bool may_move = false;
};

class NewLandmarks : public testing::Test {
 protected:
  Descriptor descriptor() { return {random_(), random_(), random_(), random_()}; }

  KeyframeId add_keyframe(const SE3& T_camera_world, const std::vector<Point>& points) {
    auto view = std::make_shared<ObservedFrame>();
    for (const Point& point : points) {
      view->pixels.push_back(camera_.project(point.in_camera).cast<float>());
      view->depths.push_back(point.depth);
      view->levels.push_back(0);
      view->angles.push_back(0.0F);
      view->colours.emplace_back(0, 0, 0);
      view->descriptors.push_back(point.descriptor);
      view->is_movable.push_back(point.may_move);
    }
    return map_.add_keyframe(0, 0.0, T_camera_world, view);
  }

  std::mt19937_64 random_{8};
  Camera camera_;
  MeasurementNoise noise_;
  Map map_{{1.0F, 1.2F, 1.44F}};
  MapMutex mutex_;
};

class LandmarksFromDepth : public NewLandmarks {
 protected:
  // A keyframe with one point at that measured depth.
  std::vector<LandmarkId> created(const Point& point, const NewLandmarkOptions& options = {}) {
    keyframe_ = add_keyframe(pose_, {point});
    return landmarks_from_depth(map_, keyframe_, camera_, noise_, options);
  }

  const SE3 pose_ = SE3::exp((Vector6d() << 0.5, -1.0, 2.0, 0.3, -0.5, 0.2).finished());
  KeyframeId keyframe_;
};

TEST_F(LandmarksFromDepth, LieWhereDepthPutsThem) {
  const Eigen::Vector3d in_camera(0.4, -0.3, 2.5);
  const auto landmarks = created({.in_camera = in_camera, .descriptor = descriptor(), .depth = 2.5F});
  ASSERT_EQ(landmarks.size(), 1U);
  const Landmark& landmark = *map_.find(landmarks.front());
  EXPECT_LT((landmark.position - pose_.inverse() * in_camera).norm(), 1e-6);
  EXPECT_EQ(map_.find(keyframe_)->landmarks.front(), landmark.id);
  ASSERT_EQ(landmark.observations.size(), 1U);
  EXPECT_EQ(landmark.observations.front().keyframe, keyframe_);
  EXPECT_TRUE(landmarks_from_depth(map_, keyframe_, camera_, noise_, {}).empty()) << "it has one by now";
}

TEST_F(LandmarksFromDepth, NeedADepthThatIsKnownAndPrecise) {
  const Eigen::Vector3d in_camera(0.4, -0.3, 2.5);
  EXPECT_EQ(created({.in_camera = in_camera, .depth = 2.5F}).size(), 1U);
  EXPECT_TRUE(created({.in_camera = in_camera, .depth = 0.0F}).empty());
  // At 40 m one sigma is 16 % of the depth, at 60 m it is 24 %.
  EXPECT_EQ(created({.in_camera = in_camera, .depth = 40.0F}).size(), 1U);
  EXPECT_TRUE(created({.in_camera = in_camera, .depth = 60.0F}).empty());
  EXPECT_EQ(created({.in_camera = in_camera, .depth = 60.0F}, {.max_relative_depth_sigma = 0.3}).size(), 1U);
}

TEST_F(LandmarksFromDepth, AreNotOnMovableObjects) {
  const Eigen::Vector3d in_camera(0.4, -0.3, 2.5);
  EXPECT_EQ(created({.in_camera = in_camera, .depth = 2.5F, .may_move = false}).size(), 1U);
  EXPECT_TRUE(created({.in_camera = in_camera, .depth = 2.5F, .may_move = true}).empty());
}

// An older and a newer keyframe side by side that look along z and share enough landmarks.
class LandmarksFromTwoViews : public NewLandmarks {
 protected:
  static constexpr std::uint32_t kShared = 15;

  // ours: in the newer keyframe, theirs: in the older one, matching in pairs; both in metres of the camera.
  std::vector<LandmarkId> created(const std::vector<Point>& ours, const std::vector<Point>& theirs,
                                  const NewLandmarkOptions& options = {}, std::uint32_t shared = kShared) {
    map_ = Map({1.0F, 1.2F, 1.44F});
    std::vector<Point> older;
    for (std::uint32_t i = 0; i < kShared; ++i)
      older.push_back({.in_camera = {0.1 * i - 0.7, 1.0, 4.0}, .descriptor = descriptor(), .depth = 4.0F});
    std::vector<Point> newer = older;
    for (Point& point : newer) point.in_camera.x() -= baseline_;
    older.insert(older.end(), theirs.begin(), theirs.end());
    newer.insert(newer.end(), ours.begin(), ours.end());
    older_ = add_keyframe(pose_, older);
    newer_ = add_keyframe(SE3(Eigen::Quaterniond::Identity(), {-baseline_, 0.0, 0.0}) * pose_, newer);
    for (std::uint32_t i = 0; i < shared; ++i) {
      const LandmarkId id = map_.add_landmark(pose_.inverse() * older[i].in_camera, older_, i);
      map_.add_observation(id, newer_, i);
    }
    return triangulate_all(options);
  }

  std::vector<LandmarkId> triangulate_all(const NewLandmarkOptions& options = {}) {
    return landmarks_from_triangulation(map_, mutex_, newer_, camera_, noise_, {}, options);
  }

  // One point, given in the camera frame of the older keyframe, and an offset of where the newer one sees it.
  std::size_t created_of(const Eigen::Vector3d& in_older, const Eigen::Vector2d& pixels_off = {0, 0},
                         const NewLandmarkOptions& options = {}, std::uint32_t shared = kShared) {
    const Point theirs{.in_camera = in_older, .descriptor = descriptor()};
    Point ours = theirs;
    ours.in_camera.x() -= baseline_;
    ours.in_camera = camera_.unproject(camera_.project(ours.in_camera) + pixels_off, ours.in_camera.z());
    return created({ours}, {theirs}, options, shared).size();
  }

  double baseline_ = 0.5;  // metres
  const SE3 pose_ = SE3::exp((Vector6d() << 0.5, -1.0, 2.0, 0.3, -0.5, 0.2).finished());
  KeyframeId older_;
  KeyframeId newer_;
};

TEST_F(LandmarksFromTwoViews, LieAtTheTruth) {
  std::vector<Point> theirs;
  for (int i = 0; i < 20; ++i) {
    theirs.push_back({.in_camera = {0.1 * i - 0.8, 0.07 * (i % 5) - 0.4, 3.0 + 0.3 * (i % 7)},
                      .descriptor = descriptor()});
  }
  std::vector<Point> ours = theirs;
  for (Point& point : ours) point.in_camera.x() -= baseline_;
  const auto landmarks = created(ours, theirs);
  ASSERT_EQ(landmarks.size(), theirs.size());
  for (const LandmarkId id : landmarks) {
    const Landmark& landmark = *map_.find(id);
    ASSERT_EQ(landmark.observations.size(), 2U);
    EXPECT_EQ(landmark.observations.front().keyframe, older_);
    EXPECT_EQ(landmark.observations.back().keyframe, newer_);
    const std::uint32_t point = landmark.observations.front().point;
    EXPECT_EQ(landmark.observations.back().point, point) << "matched with another";
    EXPECT_EQ(map_.find(older_)->landmarks[point], id);
    EXPECT_EQ(map_.find(newer_)->landmarks[point], id);
    EXPECT_LT((pose_ * landmark.position - theirs[point - kShared].in_camera).norm(), 1e-4);
    EXPECT_EQ(landmark.created_by, newer_);
  }
  EXPECT_TRUE(triangulate_all().empty()) << "all points have one by now";
}

TEST_F(LandmarksFromTwoViews, AreAsPreciseAsThePixels) {
  constexpr double kPixelSigma = 0.5;
  std::normal_distribution<double> normal(0.0, kPixelSigma);
  const auto moved = [&](const Eigen::Vector3d& in_camera) {
    const Eigen::Vector2d noise(normal(random_), normal(random_));
    return camera_.unproject(camera_.project(in_camera) + noise, in_camera.z());
  };
  std::vector<Point> theirs;
  std::vector<Point> ours;
  std::vector<Eigen::Vector3d> truth;
  for (int i = 0; i < 50; ++i) {
    truth.emplace_back(0.04 * i - 0.8, 0.07 * (i % 5) - 0.4, 3.0 + 0.3 * (i % 7));
    theirs.push_back({.in_camera = moved(truth.back()), .descriptor = descriptor()});
    ours.push_back(theirs.back());
    ours.back().in_camera = moved(truth.back() - Eigen::Vector3d(baseline_, 0.0, 0.0));
  }
  const auto landmarks = created(ours, theirs);
  ASSERT_EQ(landmarks.size(), truth.size());
  double sum = 0.0;
  for (const LandmarkId id : landmarks) {
    const Landmark& landmark = *map_.find(id);
    const Eigen::Vector3d& expected = truth[landmark.observations.front().point - kShared];
    const Eigen::Vector3d error = pose_ * landmark.position - expected;
    // Of the disparity f * baseline / z, the difference of two pixels.
    const double z = expected.z();
    const double sigma = z * z / (camera_.fx * baseline_) * std::sqrt(2.0) * kPixelSigma;
    EXPECT_LT(error.norm(), 4.0 * sigma);
    sum += error.z() * error.z() / (sigma * sigma);
  }
  EXPECT_NEAR(sum / static_cast<double>(truth.size()), 1.0, 0.5) << "in sigmas";
}

TEST_F(LandmarksFromTwoViews, NeedParallax) {
  const Eigen::Vector3d point(0.2, 0.1, 4.0);
  EXPECT_EQ(created_of(point), 1U);
  baseline_ = 0.1;  // 1.4 degrees
  EXPECT_EQ(created_of(point), 1U);
  baseline_ = 0.04;  // 0.6 degrees
  EXPECT_EQ(created_of(point), 0U);
  EXPECT_EQ(created_of(point, {0, 0}, {.min_parallax = 0.3}), 1U);
}

// The rays meet behind the cameras, where the point would project to both pixels.
TEST_F(LandmarksFromTwoViews, LieBeforeTheCameras) {
  const Descriptor same = descriptor();
  const Point left{.in_camera = {-0.25, 0.1, 4.0}, .descriptor = same};
  const Point right{.in_camera = {0.25, 0.1, 4.0}, .descriptor = same};
  EXPECT_EQ(created({left}, {right}).size(), 1U);
  EXPECT_EQ(created({right}, {left}).size(), 0U);
}

TEST_F(LandmarksFromTwoViews, LieOnTheEpipolarLine) {
  const Eigen::Vector3d point(0.2, 0.1, 4.0);
  EXPECT_EQ(created_of(point), 1U);
  EXPECT_EQ(created_of(point, {0.0, 5.0}), 1U);
  EXPECT_EQ(created_of(point, {0.0, 25.0}), 0U);
  EXPECT_EQ(created_of(point, {0.0, -25.0}), 0U);
  EXPECT_EQ(created_of(point, {25.0, 0.0}), 1U) << "along the line two views cannot tell";
}

TEST_F(LandmarksFromTwoViews, AgreeWithTheDepthOfTheOtherView) {
  Point theirs{.in_camera = {0.2, 0.1, 4.0}, .descriptor = descriptor(), .depth = 4.0F};
  Point ours = theirs;
  ours.in_camera.x() -= baseline_;
  ours.depth = 0.0F;
  EXPECT_EQ(created({ours}, {theirs}).size(), 1U);
  theirs.depth = 6.0F;
  EXPECT_EQ(created({ours}, {theirs}).size(), 0U);
}

TEST_F(LandmarksFromTwoViews, NeedEnoughSharedLandmarks) {
  const Eigen::Vector3d point(0.2, 0.1, 4.0);
  // Points that are not shared have depth, but no landmark, and match as well.
  EXPECT_EQ(created_of(point, {0, 0}, {}, kShared), 1U);
  EXPECT_EQ(created_of(point, {0, 0}, {}, kShared - 1), 0U);
  EXPECT_EQ(created_of(point, {0, 0}, {.min_shared = kShared - 1}, kShared - 1), 2U);
  EXPECT_EQ(created_of(point, {0, 0}, {.neighbours = 0}), 0U);
}

TEST_F(LandmarksFromTwoViews, AreOfPointsThatHaveNone) {
  const Point theirs{.in_camera = {0.2, 0.1, 4.0}, .descriptor = descriptor()};
  Point ours = theirs;
  ours.in_camera.x() -= baseline_;
  const auto first = created({ours}, {theirs});
  ASSERT_EQ(first.size(), 1U);
  map_.remove_observation(first.front(), newer_);
  EXPECT_TRUE(triangulate_all().empty()) << "the older keyframe sees one there";
  map_.remove_landmark(first.front());
  EXPECT_EQ(triangulate_all().size(), 1U);
}

// Points on movable objects at rest are used for poses and never mapped.
TEST_F(LandmarksFromTwoViews, AreNotOnObjectsThatAreMovableInTheNewerView) {
  for (const bool may_move : {false, true}) {
    const Point theirs{.in_camera = {0.2, 0.1, 4.0}, .descriptor = descriptor()};
    Point ours = theirs;
    ours.in_camera.x() -= baseline_;
    ours.may_move = may_move;
    EXPECT_EQ(created({ours}, {theirs}).size(), may_move ? 0U : 1U);
  }
}

TEST_F(LandmarksFromTwoViews, AreNotOnObjectsThatAreMovableInTheOlderView) {
  for (const bool may_move : {false, true}) {
    const Point theirs{.in_camera = {0.2, 0.1, 4.0}, .descriptor = descriptor(), .may_move = may_move};
    Point ours = theirs;
    ours.in_camera.x() -= baseline_;
    ours.may_move = false;
    EXPECT_EQ(created({ours}, {theirs}).size(), may_move ? 0U : 1U);
  }
}

}  // namespace
}  // namespace roslam
