// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "roslam/common/error.hpp"
#include "roslam/dense/dense_mapper.hpp"
#include "tests/dense_scene.hpp"

namespace {
using namespace roslam;
using dense_scene::kFloor;
using dense_scene::kWall;

constexpr SubmapId kHere{0}, kElsewhere{1};

// True and estimated poses of a walk past a wall.
struct Walk {
  std::vector<SE3> truth = dense_scene::walk(6);
  Camera camera = scene::small_camera();

  DepthKeyframe view(std::size_t i, Provenance provenance = Provenance::kMeasured) const {
    return dense_scene::view(dense_scene::show({kWall, kFloor}, truth[i], camera), camera,
                             dense_scene::options(), provenance);
  }
  SE3 wrong(std::size_t i) const {
    return SE3(so3_exp({0.0, 0.02 * static_cast<double>(i), 0.0}),
               {0.0, 0.0, 0.06 * static_cast<double>(i)}) *
           truth[i];
  }
};

KeyframeId id(std::size_t i) { return {static_cast<std::uint32_t>(i)}; }

void expect_same(const TsdfVolume& a, const TsdfVolume& b) {
  ASSERT_EQ(a.keys(), b.keys());
  for (const BlockKey& key : a.keys()) EXPECT_TRUE(a.find(key)->voxels == b.find(key)->voxels);
}

TEST(DenseMapper, IsAfterAMoveAsIfAllHadBeenFusedThere) {
  const Walk walk;
  DenseMapper moved(dense_scene::options(), {}), fresh(dense_scene::options(), {});
  std::map<KeyframeId, KeyframePose> places;
  for (std::size_t i = 0; i < walk.truth.size(); ++i) {
    moved.insert(id(i), walk.view(i), {kHere, i >= 3 ? walk.wrong(i) : walk.truth[i]});
    fresh.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
    places[id(i)] = {kHere, walk.truth[i]};
  }
  EXPECT_EQ(moved.follow(places), 3U);
  expect_same(*moved.map(kHere), *fresh.map(kHere));
  EXPECT_EQ(moved.follow(places), 0U);
}

TEST(DenseMapper, AMoveThatIsStoppedLeavesTheMapAsItWasAndIsTakenUpAgain) {
  const Walk walk;
  DenseMapper moved(dense_scene::options(), {}), before(dense_scene::options(), {}),
      after(dense_scene::options(), {});
  std::map<KeyframeId, KeyframePose> places;
  for (std::size_t i = 0; i < walk.truth.size(); ++i) {
    moved.insert(id(i), walk.view(i), {kHere, walk.wrong(i)});
    before.insert(id(i), walk.view(i), {kHere, walk.wrong(i)});
    after.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
    places[id(i)] = {kHere, walk.truth[i]};
  }
  int polled = 0;
  EXPECT_EQ(moved.follow(places, 1.0, [&] { return ++polled > 2; }), walk.truth.size() - 1) << "the first was right";
  EXPECT_EQ(polled, 3);
  expect_same(*moved.map(kHere), *before.map(kHere));
  EXPECT_EQ(moved.follow(places), 0U) << "they are where they belong, but for the blocks";
  expect_same(*moved.map(kHere), *after.map(kHere));
}

TEST(DenseMapper, LeavesBeWhatHardlyMoved) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {});
  mapper.insert(id(0), walk.view(0), {kHere, walk.truth[0]});
  const SE3 nudge(Eigen::Quaterniond::Identity(), {0.01, 0.0, 0.0});
  EXPECT_EQ(mapper.follow({{id(0), {kHere, nudge * walk.truth[0]}}}), 0U);
  EXPECT_EQ(mapper.follow({{id(0), {kHere, nudge * walk.truth[0]}}}, 0.2), 1U);
}

TEST(DenseMapper, LosesWhatWasWithdrawn) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {}), fresh(dense_scene::options(), {});
  for (std::size_t i = 0; i < 4; ++i) {
    mapper.insert(id(i), walk.view(i), {kHere, i == 2 ? walk.wrong(i) : walk.truth[i]});
    if (i != 2) fresh.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
  }
  EXPECT_EQ(mapper.follow({{id(2), KeyframePose{}}}), 1U);
  expect_same(*mapper.map(kHere), *fresh.map(kHere));
  EXPECT_EQ(mapper.keyframes(), fresh.keyframes());
  EXPECT_EQ(mapper.view_bytes(), fresh.view_bytes());
  mapper.insert(id(5), walk.view(2), KeyframePose{});  // withdrawn before it was fused
  EXPECT_EQ(mapper.keyframes(), fresh.keyframes());
}

TEST(DenseMapper, KeepsWorldsApartUntilTheyMeet) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {}), fresh(dense_scene::options(), {});
  for (std::size_t i = 0; i < 4; ++i) {
    mapper.insert(id(i), walk.view(i), {i < 2 ? kHere : kElsewhere, walk.truth[i]});
    fresh.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
  }
  ASSERT_NE(mapper.map(kElsewhere), nullptr);
  EXPECT_FALSE(mapper.surface(kElsewhere).points.empty());
  mapper.follow({{id(2), {kHere, walk.truth[2]}}, {id(3), {kHere, walk.truth[3]}}});
  EXPECT_EQ(mapper.map(kElsewhere), nullptr);
  EXPECT_TRUE(mapper.surface(kElsewhere).points.empty());
  expect_same(*mapper.map(kHere), *fresh.map(kHere));
}

TEST(DenseMapper, LeavesOutWhatWasInventedIfAsked) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {});
  mapper.insert(id(0), walk.view(0, Provenance::kInpainted), {kHere, walk.truth[0]});
  EXPECT_FALSE(mapper.surface(kHere).points.empty());
  EXPECT_TRUE(without_inpainted(mapper.surface(kHere)).points.empty());
  mapper.insert(id(1), walk.view(0), {kHere, walk.truth[0]});
  EXPECT_FALSE(without_inpainted(mapper.surface(kHere)).points.empty());
  for (const SurfacePoint& point : mapper.surface(kHere).points)
    EXPECT_EQ(point.provenance, Provenance::kMeasured);
}

TEST(DenseMapper, ChoosesTheVoxelByHowFarThingsAre) {
  const Walk walk;
  DenseOptions options = dense_scene::options();
  options.voxel_size = 0.0;
  DenseMapper room(options, {}), street(options, {});
  room.insert(id(0), walk.view(0), {kHere, walk.truth[0]});
  EXPECT_EQ(room.voxel_size(), 0.02);
  dense_scene::Slab far = kWall;
  far.at = 7.0;
  street.insert(id(0), dense_scene::view(dense_scene::show({far}, SE3(), walk.camera), walk.camera),
                {kHere, SE3()});
  EXPECT_EQ(street.voxel_size(), 0.05);
}

TEST(DenseMapper, BecomesCoarserInsteadOfTooLarge) {
  const Walk walk;
  DenseOptions options = dense_scene::options();
  options.voxel_size = 0.01;
  options.max_memory = 16;
  DenseMapper mapper(options, {});
  for (std::size_t i = 0; i < 3; ++i) mapper.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
  EXPECT_GE(mapper.times_coarsened(), 1);
  EXPECT_LE(mapper.voxel_bytes(), 16000000U);
  const SurfaceMap surface = mapper.surface(kHere);
  ASSERT_FALSE(surface.points.empty());
  DenseOptions coarse = options;
  coarse.voxel_size = mapper.voxel_size();
  DenseMapper fresh(coarse, {});
  for (std::size_t i = 0; i < 3; ++i) fresh.insert(id(i), walk.view(i), {kHere, walk.truth[i]});
  expect_same(*mapper.map(kHere), *fresh.map(kHere));
}

TEST(DenseMapper, PassesOverViewsWithoutDepthAndPosesThatAreNone) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {});
  const auto image = dense_scene::show({kWall}, SE3(), walk.camera);
  const DepthKeyframe blind = dense_scene::view({image.colour, {}}, walk.camera);
  EXPECT_EQ(cv::countNonZero(blind.depth), 0);
  mapper.insert(id(0), blind, {kHere, SE3()});
  const SE3 nowhere = SE3::from_parts(Eigen::Quaterniond::Identity(),
                                      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  mapper.insert(id(1), walk.view(1), {kHere, nowhere});
  EXPECT_TRUE(mapper.keyframes().empty());
  EXPECT_TRUE(mapper.surface(kHere).points.empty());
  mapper.insert(id(2), walk.view(2), {kHere, walk.truth[2]});
  EXPECT_EQ(mapper.follow({{id(2), {kElsewhere, nowhere}}}), 0U);
}

TEST(DenseMapper, LeavesBeWhatIsBeyondItsRange) {
  DenseOptions options = dense_scene::options();
  options.max_depth = 3.0;
  const Walk walk;
  DenseMapper mapper(options, {});
  mapper.insert(
      id(0), dense_scene::view(dense_scene::show({kWall, kFloor}, SE3(), walk.camera), walk.camera, options),
      {kHere, SE3()});
  ASSERT_FALSE(mapper.surface(kHere).points.empty());
  for (const SurfacePoint& point : mapper.surface(kHere).points) EXPECT_LT(point.position.z(), 3.1F);
}

TEST(DenseMapper, SurvivesAPoseThatJumpsFarAway) {
  const Walk walk;
  DenseMapper mapper(dense_scene::options(), {});
  mapper.insert(id(0), walk.view(0), {kHere, walk.truth[0]});
  const std::size_t bytes = mapper.voxel_bytes();
  const SE3 jump(Eigen::Quaterniond::Identity(), {100.0, 0.0, 0.0});
  mapper.insert(id(1), walk.view(1), {kHere, jump * walk.truth[1]});
  EXPECT_LT(mapper.voxel_bytes(), 3 * bytes);
  EXPECT_EQ(mapper.follow({{id(1), {kHere, walk.truth[1]}}}), 1U);
  for (const SurfacePoint& point : mapper.surface(kHere).points) EXPECT_LT(point.position.x(), 50.0F);
  const SE3 astray(Eigen::Quaterniond::Identity(), {1e9, 0.0, 0.0});
  mapper.insert(id(2), walk.view(2), {kHere, astray});
  EXPECT_LT(mapper.voxel_bytes(), 3 * bytes);
}

TEST(DepthKeyframe, IsUnpackedAsItWasPacked) {
  const Walk walk;
  DepthKeyframe view = walk.view(0);
  view.labels.setTo(7, view.depth > 3.0F);
  view.provenance.row(5).setTo(255);
  view.noise = DepthNoise{0.001, 0.007};
  const DepthKeyframe again = unpack(pack(view));
  EXPECT_EQ(again.noise, view.noise);
  EXPECT_LE(cv::norm(view.depth, again.depth, cv::NORM_INF), 0.00051);
  EXPECT_EQ(cv::norm(view.labels, again.labels, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(view.provenance, again.provenance, cv::NORM_INF), 0.0);
  EXPECT_LT(cv::norm(view.colour, again.colour, cv::NORM_L1) / static_cast<double>(view.colour.total()), 6.0);
}

TEST(DepthKeyframeReducer, TakesTheLensAway) {
  Camera camera = scene::small_camera();
  camera.distortion = {-0.2, 0.05, 0.001, -0.002, 0.0};
  // An image through the lens: each pixel holds its own ray, as depth that grows to the right.
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      depth.at<float>(y, x) = static_cast<float>(2.0 + 0.001 * camera.undistort({x, y}).x());
  const cv::Mat colour = cv::Mat::zeros(depth.size(), CV_8UC3);
  const DenseOptions options = dense_scene::options();
  const DepthKeyframe view = DepthKeyframeReducer(camera, options, {}).reduce(colour, depth, {}, {});
  EXPECT_FALSE(view.camera.has_distortion());
  for (int y = 10; y < view.depth.rows - 10; y += 20)
    for (int x = 10; x < view.depth.cols - 10; x += 20)
      EXPECT_NEAR(view.depth.at<float>(y, x), 2.0 + 0.001 * x * options.stride, 0.0012);
}

TEST(DepthKeyframeReducer, KnowsWhatLiesBeyondItsReach) {
  const Walk walk;
  DenseOptions options = dense_scene::options();
  options.max_depth = 3.5;
  const auto image = dense_scene::show({kWall, kFloor}, SE3(), walk.camera);  // the wall is 4 m away
  cv::Mat hidden = cv::Mat::zeros(image.depth.size(), CV_8UC1);
  hidden.colRange(0, 40).setTo(255);
  const DepthKeyframe view = unpack(
      pack(DepthKeyframeReducer(walk.camera, options, {}).reduce(image.colour, image.depth, {}, hidden)));
  EXPECT_EQ(view.reach, 3.5);
  EXPECT_EQ(view.beyond.at<std::uint8_t>(10, 60), 255);
  EXPECT_EQ(view.depth.at<float>(10, 60), 0.0F);
  EXPECT_EQ(view.beyond.at<std::uint8_t>(view.beyond.rows - 3, 60), 0);
  EXPECT_EQ(cv::countNonZero(view.beyond.colRange(0, 20)), 0);
}

TEST(DepthKeyframeReducer, HidesWhatIsHidden) {
  const Walk walk;
  const auto image = dense_scene::show({kWall}, SE3(), walk.camera);
  cv::Mat hidden = cv::Mat::zeros(image.depth.size(), CV_8UC1);
  hidden(cv::Rect(100, 100, 50, 40)).setTo(255);
  const DepthKeyframe view = DepthKeyframeReducer(walk.camera, dense_scene::options(), {})
                                 .reduce(image.colour, image.depth, {}, hidden);
  EXPECT_EQ(cv::countNonZero(view.depth), static_cast<int>(view.depth.total()) - 25 * 20);
}

TEST(DenseOptions, NamesTheFieldThatIsOutOfRange) {
  DenseOptions options;
  options.stride = 0;
  try {
    options.validate();
    FAIL();
  } catch (const OptionsError& error) {
    EXPECT_NE(std::string(error.what()).find("dense.stride"), std::string::npos);
  }
}
}  // namespace
