// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/matching/projection_matcher.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace roslam {
namespace {

// A descriptor at that distance from the one of all zeros; two of them differ by the difference of their
// distances.
Descriptor bits(int count) {
  Descriptor result{};
  for (int i = 0; i < count; ++i) result[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return result;
}

struct Point {
  Eigen::Vector2f pixel{300.0F, 200.0F};
  int distance = 0;  // bits, from the descriptor of all zeros
  int level = 0;
  float depth = 0.0F;
};

ObservedFrame frame_of(const std::vector<Point>& points) {
  ObservedFrame frame;
  for (const Point& point : points) {
    frame.pixels.push_back(point.pixel);
    frame.depths.push_back(point.depth);
    frame.levels.push_back(static_cast<std::uint8_t>(point.level));
    frame.angles.push_back(0.0F);
    frame.colours.emplace_back(0, 0, 0);
    frame.descriptors.push_back(bits(point.distance));
  }
  frame.grid = FeatureGrid(frame.pixels, {0.0, 0.0, 640.0, 480.0});
  return frame;
}

class FindByProjection : public testing::Test {
 protected:
  using Query = ProjectionMatcher::Query;

  int find(const Query& query, const std::vector<Point>& points) {
    return matcher_.find(query, {}, frame_of(points), std::vector<LandmarkId>(points.size()));
  }

  ProjectionMatcher matcher_{MatcherOptions{}};
  const Query query_{.pixel = {300.0F, 200.0F}, .radius = 3.0F, .max_level = 7, .max_distance = 100};
};

TEST_F(FindByProjection, SearchesWithinTheRadius) {
  EXPECT_EQ(find(query_, {}), -1);
  EXPECT_EQ(find(query_, {{.pixel = {302.9F, 197.1F}}}), 0);
  EXPECT_EQ(find(query_, {{.pixel = {303.1F, 200.0F}}}), -1);
  EXPECT_EQ(find(query_, {{.pixel = {300.0F, 196.9F}}}), -1);
  Query wider = query_;
  wider.radius = 3.2F;
  EXPECT_EQ(find(wider, {{.pixel = {303.1F, 200.0F}}}), 0);
}

TEST_F(FindByProjection, SearchesTheLevelsAskedFor) {
  const std::vector<Point> points{{.level = 2}};
  const auto find_in = [&](int min_level, int max_level) {
    Query query = query_;
    query.min_level = min_level;
    query.max_level = max_level;
    return find(query, points);
  };
  EXPECT_EQ(find_in(2, 2), 0);
  EXPECT_EQ(find_in(1, 3), 0);
  EXPECT_EQ(find_in(0, 1), -1);
  EXPECT_EQ(find_in(3, 7), -1);
  EXPECT_EQ(find_in(-1, 1), -1);
  EXPECT_EQ(find_in(-1, 2), 0);
}

TEST_F(FindByProjection, TakesTheNearestDescriptor) {
  const std::vector<Point> points{{.distance = 60},
                                  {.pixel = {302.0F, 201.0F}, .distance = 20},
                                  {.pixel = {301.0F, 200.0F}, .distance = 40}};
  EXPECT_EQ(find(query_, points), 1);
  Query stricter = query_;
  stricter.max_distance = 20;
  EXPECT_EQ(find(stricter, points), 1);
  stricter.max_distance = 19;
  EXPECT_EQ(find(stricter, points), -1);
}

TEST_F(FindByProjection, TheRatioTestIsOfPointsOfOneLevel) {
  Query with_ratio = query_;
  with_ratio.use_ratio = true;
  const std::vector<Point> ambiguous{{.distance = 12, .level = 1}, {.distance = 10, .level = 1}};
  EXPECT_EQ(find(with_ratio, ambiguous), -1);
  EXPECT_EQ(find(query_, ambiguous), 1);
  EXPECT_EQ(find(with_ratio, {{.distance = 12, .level = 2}, {.distance = 10, .level = 1}}), 1)
      << "one point on two levels is not ambiguous";
  EXPECT_EQ(find(with_ratio, {{.distance = 13, .level = 1}, {.distance = 10, .level = 1}}), 1);
  EXPECT_EQ(find(with_ratio, {{.distance = 10}}), 0) << "there is no second";
}

TEST_F(FindByProjection, TheRatioTestLeavesOutWhatIsThereTwice) {
  Query with_ratio = query_;
  with_ratio.use_ratio = true;
  EXPECT_EQ(find(with_ratio, {{.distance = 0}, {.distance = 0}}), -1);
  EXPECT_EQ(find(query_, {{.distance = 0}, {.distance = 0}}), 0);
}

TEST_F(FindByProjection, DepthMayDifferByTheTolerance) {
  Query query = query_;
  query.depth = 2.0F;
  EXPECT_EQ(find(query, {{.depth = 2.19F}}), 0);
  EXPECT_EQ(find(query, {{.depth = 2.21F}}), -1);
  EXPECT_EQ(find(query, {{.depth = 1.81F}}), 0);
  EXPECT_EQ(find(query, {{.depth = 1.79F}}), -1);
  EXPECT_EQ(find(query, {{.depth = 0.0F}}), 0) << "the depth of the point is unknown";
  EXPECT_EQ(find(query_, {{.depth = 9.0F}}), 0) << "any depth was asked for";
  EXPECT_EQ(find(query, {{.distance = 5, .depth = 5.0F}, {.distance = 30, .depth = 2.0F}}), 1);
}

// Two landmarks that both resemble one point most.
TEST_F(FindByProjection, OfTwoLandmarksOnlyTheFirstGetsThePoint) {
  const ObservedFrame frame = frame_of({{.distance = 6}, {.pixel = {301.0F, 200.0F}, .distance = 40}});
  const Descriptor first = bits(4);
  const Descriptor second = bits(8);
  std::vector<LandmarkId> taken(frame.size());
  ASSERT_EQ(matcher_.find(query_, first, frame, taken), 0);
  ASSERT_EQ(matcher_.find(query_, second, frame, taken), 0) << "they do not compete";
  taken[0] = LandmarkId{1};
  EXPECT_EQ(matcher_.find(query_, second, frame, taken), 1);
  taken[1] = LandmarkId{2};
  EXPECT_EQ(matcher_.find(query_, second, frame, taken), -1);
}

TEST_F(FindByProjection, APointThatIsTakenMakesNoOtherAmbiguous) {
  Query with_ratio = query_;
  with_ratio.use_ratio = true;
  const ObservedFrame frame = frame_of({{.distance = 10}, {.distance = 11}});
  std::vector<LandmarkId> taken(frame.size());
  EXPECT_EQ(matcher_.find(with_ratio, {}, frame, taken), -1);
  taken[0] = LandmarkId{1};
  EXPECT_EQ(matcher_.find(with_ratio, {}, frame, taken), 1);
}

// A landmark four metres ahead that faces the camera.
class Predict : public testing::Test {
 protected:
  Predict() {
    landmark_.position = {0.0, 0.0, 4.0};
    landmark_.normal = {0.0, 0.0, -1.0};
    landmark_.min_distance = 2.0F;
    landmark_.max_distance = 6.0F;
  }

  std::optional<Prediction> predicted(const SE3& T_camera_world = {}) const {
    return predict(landmark_, map_, frame_, camera_, T_camera_world);
  }

  Camera camera_;
  Map map_{{1.0F, 1.2F, 1.44F, 1.728F}};
  const ObservedFrame frame_ = frame_of({});
  Landmark landmark_;
};

TEST_F(Predict, SaysWhereALandmarkIsSeen) {
  const SE3 T_camera_world = SE3::exp((Vector6d() << 0.2, -0.1, 0.3, 0.05, -0.1, 0.02).finished());
  const Eigen::Vector3d in_camera = T_camera_world * landmark_.position;
  const auto prediction = predicted(T_camera_world);
  ASSERT_TRUE(prediction);
  EXPECT_LT((prediction->pixel.cast<double>() - camera_.project(in_camera)).norm(), 1e-3);
  EXPECT_NEAR(prediction->depth, in_camera.z(), 1e-5);
  const Eigen::Vector3d centre = T_camera_world.inverse().translation();
  EXPECT_NEAR(prediction->view_cosine, (centre - landmark_.position).normalized().dot(landmark_.normal),
              1e-5);
  EXPECT_LT(prediction->view_cosine, 0.999F);
}

TEST_F(Predict, FinerLevelsShowItFromFarther) {
  // Seen on level 1 from four metres: on level 0 from 4.8 m, on level 2 from 3.3 m.
  landmark_.max_distance = 4.0F * 1.2F * 1.2F;
  const auto level_at = [&](double distance) {
    landmark_.position.z() = distance;
    return predicted()->level;
  };
  EXPECT_EQ(level_at(5.0), 0);
  EXPECT_EQ(level_at(4.1), 1);
  EXPECT_EQ(level_at(3.5), 2);
  EXPECT_EQ(level_at(2.9), 3);
  EXPECT_EQ(level_at(2.1), 3) << "there are no coarser levels";
}

TEST_F(Predict, NothingOutsideTheImage) {
  const auto is_seen_at = [&](const Eigen::Vector2d& pixel) {
    landmark_.position = camera_.unproject(pixel, 4.0);
    landmark_.normal = -landmark_.position.normalized();
    return predicted().has_value();
  };
  EXPECT_TRUE(is_seen_at({639.0, 200.0}));
  EXPECT_FALSE(is_seen_at({641.0, 200.0}));
  EXPECT_TRUE(is_seen_at({1.0, 200.0}));
  EXPECT_FALSE(is_seen_at({-1.0, 200.0}));
  EXPECT_TRUE(is_seen_at({200.0, 479.0}));
  EXPECT_FALSE(is_seen_at({200.0, 481.0}));
  EXPECT_FALSE(is_seen_at({200.0, -1.0}));
}

// It projects into the image, at a distance and from an angle at which it is recognised, but from behind.
TEST_F(Predict, NothingBehindTheCamera) {
  EXPECT_TRUE(predicted());
  landmark_.position = -landmark_.position;
  landmark_.normal = -landmark_.normal;
  EXPECT_FALSE(predicted());
}

TEST_F(Predict, NothingBeyondTheDistanceLimits) {
  const auto is_seen_from = [&](double distance) {
    landmark_.position.z() = distance;
    return predicted().has_value();
  };
  EXPECT_FALSE(is_seen_from(1.99));
  EXPECT_TRUE(is_seen_from(2.01));
  EXPECT_TRUE(is_seen_from(5.99));
  EXPECT_FALSE(is_seen_from(6.01));
}

TEST_F(Predict, NothingMoreThanSixtyDegreesOffTheNormal) {
  const auto turned_by = [&](double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    landmark_.normal = {std::sin(angle), 0.0, -std::cos(angle)};
    return predicted();
  };
  ASSERT_TRUE(turned_by(59.0));
  EXPECT_NEAR(turned_by(59.0)->view_cosine, std::cos(59.0 * std::numbers::pi / 180.0), 1e-5);
  EXPECT_TRUE(turned_by(-59.0));
  EXPECT_FALSE(turned_by(61.0));
  EXPECT_FALSE(turned_by(-61.0));
}

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs matched(const std::vector<Point>& a, const std::vector<std::uint32_t>& from,
              const std::vector<Point>& b, const MatcherOptions& options = {}) {
  return match_descriptors(frame_of(a), from, frame_of(b), options);
}

TEST(MatchOverImages, HoldsToTheStrictDistance) {
  EXPECT_EQ(matched({{}}, {0}, {{.distance = 50}}), (Pairs{{0, 0}}));
  EXPECT_TRUE(matched({{}}, {0}, {{.distance = 51}}).empty());
  EXPECT_TRUE(matched({{}}, {}, {{}}).empty());
  EXPECT_TRUE(matched({{}}, {0}, {}).empty());
}

TEST(MatchOverImages, LeavesOutWhatIsAmbiguous) {
  EXPECT_TRUE(matched({{}}, {0}, {{.distance = 35}, {.distance = 30}}).empty());
  EXPECT_EQ(matched({{}}, {0}, {{.distance = 40}, {.distance = 30}}), (Pairs{{0, 1}}));
  EXPECT_EQ(matched({{}}, {0}, {{.distance = 35}, {.distance = 30}}, {.ratio = 1.0}), (Pairs{{0, 1}}));
}

TEST(MatchOverImages, OfTwoClaimantsTheCloserOneWins) {
  // Both points of a are nearest to the first of b, at 10 and at 6 bits.
  const std::vector<Point> a{{.distance = 10}, {.distance = 14}};
  const std::vector<Point> b{{.distance = 20}, {.distance = 100}};
  ASSERT_EQ(matched(a, {0}, b), (Pairs{{0, 0}})) << "they do not compete";
  ASSERT_EQ(matched(a, {1}, b), (Pairs{{1, 0}})) << "they do not compete";
  EXPECT_EQ(matched(a, {0, 1}, b), (Pairs{{1, 0}}));
  EXPECT_EQ(matched(a, {1, 0}, b), (Pairs{{1, 0}}));
}

TEST(MatchOverImages, OfTwoEquallyCloseClaimantsTheFirstWins) {
  const std::vector<Point> a{{.distance = 14}, {.distance = 26}};
  const std::vector<Point> b{{.distance = 20}, {.distance = 100}};
  EXPECT_EQ(matched(a, {0, 1}, b), (Pairs{{0, 0}}));
  EXPECT_EQ(matched(a, {1, 0}, b), (Pairs{{1, 0}}));
}

TEST(MatchOverImages, OnlyThePointsAskedForCompete) {
  const std::vector<Point> a{{.distance = 10}, {.distance = 20}};
  EXPECT_EQ(matched(a, {0}, {{.distance = 20}, {.distance = 100}}), (Pairs{{0, 0}}));
}

TEST(RotationHistogram, KeepsTheThreeLargestBins) {
  std::vector<float> turns;
  const auto add = [&](int count, float degrees) {
    turns.insert(turns.end(), static_cast<std::size_t>(count), degrees);
  };
  add(50, 6.0F);
  add(20, 66.0F);
  add(10, 126.0F);
  add(9, 186.0F);
  const auto keep = consistent_rotation(turns);
  ASSERT_EQ(keep.size(), turns.size());
  for (std::size_t i = 0; i < keep.size(); ++i) EXPECT_EQ(keep[i], i < 80) << turns[i];
}

TEST(RotationHistogram, DropsBinsBelowATenthOfTheLargest) {
  for (const int others : {4, 5}) {
    std::vector<float> turns(50, 6.0F);
    turns.insert(turns.end(), static_cast<std::size_t>(others), 66.0F);
    EXPECT_EQ(consistent_rotation(turns).back(), others == 5) << others;
  }
}

}  // namespace
}  // namespace roslam
