// SPDX-License-Identifier: BSD-3-Clause
// Loop closing on flights along walls with known drift and ground truth.
#include <gtest/gtest.h>

#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/loop_closing/map_correction.hpp"
#include "roslam/options/options.hpp"
#include "roslam/options/settings.hpp"
#include "tests/loop_scene.hpp"

namespace roslam::scene {
namespace {

class LoopTest : public testing::Test {
 protected:
  static constexpr double kStep = 0.05;  // radians between keyframes on the ring: 0.6 m
  static constexpr double kDrift = 0.004;

  void use(const Options& options) {
    std::vector<std::vector<Descriptor>> images;
    for (int i = 0; i < 60; ++i) images.push_back(flight_.view(WallFlight::on_ring(0.11 * i))->descriptors);
    for (int i = 0; i < 60; ++i) images.push_back(flight_.view(WallFlight::on_wall(2.0 * i))->descriptors);
    places_.emplace(
        std::make_shared<const Vocabulary>(Vocabulary::train(images, {.branching = 10, .depth = 3})));
    closer_.emplace(flight_.camera(), map_, *places_, mutex_, loop_settings(options));
  }

  // Once around and a bit further.
  void fly_ring(double radians) {
    for (double angle = 0.0; angle < radians; angle += kStep)
      closer_->process(flight_.fly_to(WallFlight::on_ring(angle), kDrift, map_));
  }

  WallFlight flight_{7};
  Map map_{{1.0F, 1.2F, 1.44F, 1.728F}};
  MapMutex mutex_;
  std::optional<KeyframeDatabase> places_;
  std::optional<LoopCloser> closer_;
};

TEST_F(LoopTest, TakesTheDriftOut) {
  flight_.build_ring();
  use({});
  fly_ring(2.0 * M_PI - 0.3);
  EXPECT_TRUE(closer_->closed().empty()) << "nothing was seen twice so far";
  const KeyframeId last{static_cast<std::uint32_t>(flight_.flown() - 1)};
  const double drifted = flight_.error_of(map_, last);
  ASSERT_GT(drifted, 0.3);
  for (double angle = 2.0 * M_PI - 0.25; angle < 2.0 * M_PI + 0.5; angle += kStep)
    closer_->process(flight_.fly_to(WallFlight::on_ring(angle), kDrift, map_));
  ASSERT_GE(closer_->closed().size(), 1U);
  EXPECT_EQ(closer_->refused(), 0U);
  EXPECT_GT(closer_->closed().front().moved, 0.5 * drifted);
  EXPECT_LT(flight_.error_of(map_, last), 0.1 * drifted);
  EXPECT_LT(flight_.mean_error(map_), 0.25 * drifted);
  EXPECT_EQ(map_.loops().size(), closer_->closed().size());
  // Duplicate landmarks are fused: keyframes on both sides of the loop share landmarks.
  const auto neighbours = map_.covisible(closer_->closed().front().keyframe, 15);
  EXPECT_TRUE(std::any_of(neighbours.begin(), neighbours.end(),
                          [](const auto& neighbour) { return neighbour.first.value < 20; }));
}

TEST_F(LoopTest, StaysOutWhereNothingIsSeenTwice) {
  flight_.build_wall(120.0, 1000.0);
  use({});
  for (double x = 0.0; x < 100.0; x += 0.6)
    closer_->process(flight_.fly_to(WallFlight::on_wall(x), kDrift, map_));
  EXPECT_TRUE(closer_->closed().empty());
}

// A wall that looks the same every ten metres: images and geometry match at a place that it is not.
class RepeatingWall : public LoopTest {
 protected:
  // Flies along it until a loop is confirmed, which is wrong, or to its end.
  void fly_along(const Options& options) {
    flight_.build_wall(120.0, 10.0);
    use(options);
    for (double x = 0.0; x < 100.0 && confirmed() == 0; x += 0.6)
      closer_->process(flight_.fly_to(WallFlight::on_wall(x), 0.001, map_));
  }

  // Loops that passed every check of the detector, whether or not the pose graph refused them.
  std::size_t confirmed() const { return closer_->closed().size() + closer_->refused(); }

  static constexpr double kAnyMetres = 1e6;
};

// Perceptual aliasing: images and geometry match; only the implausible drift rejects the loop hypothesis.
TEST_F(RepeatingWall, DoesNotFoolTheDetector) {
  Options options;
  options.loop.max_correction = kAnyMetres;
  fly_along(options);
  EXPECT_EQ(confirmed(), 0U);
}

TEST_F(RepeatingWall, WouldFoolTheDetectorIfAnyDriftWerePlausible) {
  Options options;
  options.loop.max_drift = 1.0;
  options.loop.max_correction = kAnyMetres;
  fly_along(options);
  EXPECT_GE(confirmed(), 1U);
  EXPECT_TRUE(closer_->closed().empty()) << "the pose graph refuses it still";
}

TEST_F(RepeatingWall, WouldBeClosedIfThePoseGraphRefusedNothingEither) {
  Options options;
  options.loop.max_drift = 1.0;
  options.loop.max_correction = kAnyMetres;
  options.loop_closer.max_error = 1e6;
  fly_along(options);
  EXPECT_GE(closer_->closed().size(), 1U);
}

// However long the path, and however much drift a share of it would allow.
TEST_F(RepeatingWall, DoesNotFoolTheDetectorBeyondTheLargestCorrection) {
  Options options;
  options.loop.max_drift = 1.0;
  options.loop.max_correction = 5.0;
  fly_along(options);
  EXPECT_EQ(confirmed(), 0U);
}

TEST_F(LoopTest, ALoopThatWouldCorrectMoreThanItMayIsNotClosed) {
  flight_.build_ring();
  Options options;
  options.loop.max_correction = 0.1;  // TakesTheDriftOut has more to correct, and closes with the default
  use(options);
  fly_ring(2.0 * M_PI + 0.5);
  const KeyframeId before_loop{static_cast<std::uint32_t>((2.0 * M_PI - 0.3) / kStep)};
  EXPECT_GT(flight_.error_of(map_, before_loop), 0.3);
  EXPECT_TRUE(closer_->closed().empty());
  EXPECT_EQ(closer_->refused(), 0U) << "it is no loop in the first place";
}

TEST_F(LoopTest, ClosesNoneWhereItsOptionsForbid) {
  flight_.build_ring();
  Options options;
  options.loop.min_inliers = 1000;
  use(options);
  fly_ring(2.0 * M_PI + 0.5);
  EXPECT_TRUE(closer_->closed().empty());
}

TEST_F(LoopTest, ALoopThatBendsTheMapTooMuchIsRefused) {
  flight_.build_ring();
  Options options;
  options.loop_closer.max_error = 1e-6;
  use(options);
  fly_ring(2.0 * M_PI + 0.5);
  EXPECT_TRUE(closer_->closed().empty());
  EXPECT_GE(closer_->refused(), 1U);
}

TEST_F(LoopTest, FindsWhereAViewIs) {
  flight_.build_ring();
  for (double angle = 0.0; angle < 1.0; angle += kStep) flight_.fly_to(WallFlight::on_ring(angle), 0.0, map_);
  const Options options;
  GeometricVerifier check(flight_.camera(), loop_settings(options).place);
  const SE3 T_camera_world = WallFlight::on_ring(0.43);
  const auto match =
      check.match(map_, KeyframeId{8}, *flight_.view(T_camera_world), options.loop.min_inliers);
  ASSERT_TRUE(match);
  EXPECT_EQ(match->matched_keyframe, KeyframeId{8});
  EXPECT_LT((match->T_camera_world * T_camera_world.inverse()).log().norm(), 0.02);
  EXPECT_GE(match->inliers, options.loop.min_inliers);
  EXPECT_FALSE(check.match(map_, KeyframeId{0}, *flight_.view(WallFlight::on_ring(3.0)), 20));
  EXPECT_FALSE(check.match(map_, KeyframeId{100}, *flight_.view(T_camera_world), 20));
}

TEST_F(LoopTest, ACorrectionMovesWhatCameAfterItWasWorkedOut) {
  flight_.build_ring();
  for (double angle = 0.0; angle < 0.5; angle += kStep) flight_.fly_to(WallFlight::on_ring(angle), 0.0, map_);
  MapCorrection correction;
  Vector6d tangent;
  tangent << 0.3, -0.1, 0.2, 0.02, 0.05, -0.01;
  const SE3 T_old_new = SE3::exp(tangent);
  for (const KeyframeId id : map_.keyframe_ids()) correction.T_old_new[id] = T_old_new;
  for (double angle = 0.5; angle < 1.0; angle += kStep) flight_.fly_to(WallFlight::on_ring(angle), 0.0, map_);
  std::vector<SE3> poses;
  for (const KeyframeId id : map_.keyframe_ids()) poses.push_back(map_.find(id)->T_camera_world);
  std::vector<Eigen::Vector3d> in_camera;
  for (const LandmarkId id : map_.landmark_ids()) {
    const auto& landmark = *map_.find(id);
    in_camera.push_back(map_.find(landmark.observations.front().keyframe)->T_camera_world *
                        landmark.position);
  }
  const std::size_t corrections = map_.corrections();
  correction.apply_to(map_);
  EXPECT_EQ(map_.corrections(), corrections + 1);
  // The whole map moved rigidly, so that relative poses do not change.
  for (const KeyframeId id : map_.keyframe_ids()) {
    const SE3 expected = poses[id.index()] * T_old_new;
    EXPECT_LT((map_.find(id)->T_camera_world * expected.inverse()).log().norm(), 1e-9);
  }
  std::size_t k = 0;
  for (const LandmarkId id : map_.landmark_ids()) {
    const auto& landmark = *map_.find(id);
    const Keyframe& keyframe = *map_.find(landmark.observations.front().keyframe);
    EXPECT_LT((keyframe.T_camera_world * landmark.position - in_camera[k++]).norm(), 1e-9);
    const Eigen::Vector3d direction =
        (keyframe.T_camera_world.inverse().translation() - landmark.position).normalized();
    EXPECT_GT(direction.dot(landmark.normal), 0.8);
  }
}

TEST_F(LoopTest, LoopsOfARemovedKeyframeHangOnItsAnchor) {
  flight_.build_ring();
  for (double angle = 0.0; angle < 0.5; angle += kStep) flight_.fly_to(WallFlight::on_ring(angle), 0.0, map_);
  const auto relative = [&](std::uint32_t from, std::uint32_t to) {
    return map_.T_camera_world(KeyframeId{to}) * map_.T_camera_world(KeyframeId{from}).inverse();
  };
  map_.add_loop(KeyframeId{1}, KeyframeId{8}, relative(1, 8));
  map_.remove_keyframe(KeyframeId{8}, KeyframeId{7});
  ASSERT_EQ(map_.loops().size(), 1U);
  EXPECT_EQ(map_.loops().front().to, KeyframeId{7});
  EXPECT_LT((map_.loops().front().T_to_from * relative(1, 7).inverse()).log().norm(), 1e-9);
  map_.remove_keyframe(KeyframeId{7}, KeyframeId{1});
  EXPECT_TRUE(map_.loops().empty());
}

TEST_F(LoopTest, RepeatsBitByBit) {
  const auto poses = [] {
    WallFlight flight(3);
    flight.build_ring();
    Map map({1.0F, 1.2F, 1.44F, 1.728F});
    MapMutex mutex;
    std::vector<std::vector<Descriptor>> images;
    for (int i = 0; i < 60; ++i) images.push_back(flight.view(WallFlight::on_ring(0.11 * i))->descriptors);
    KeyframeDatabase places(
        std::make_shared<const Vocabulary>(Vocabulary::train(images, {.branching = 10, .depth = 3})));
    LoopCloser closer(flight.camera(), map, places, mutex, loop_settings(Options()));
    for (double angle = 0.0; angle < 2.0 * M_PI + 0.5; angle += kStep)
      closer.process(flight.fly_to(WallFlight::on_ring(angle), kDrift, map));
    EXPECT_GE(closer.closed().size(), 1U);
    std::vector<Eigen::Matrix4d> result;
    for (const KeyframeId id : map.keyframe_ids()) result.push_back(map.find(id)->T_camera_world.matrix());
    return result;
  };
  EXPECT_EQ(poses(), poses());
}

}  // namespace
}  // namespace roslam::scene
