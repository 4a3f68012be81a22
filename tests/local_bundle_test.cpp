// SPDX-License-Identifier: BSD-3-Clause
// The parts of a map that bundle adjustment takes, and what it writes back.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>

#include "roslam/loop_closing/global_bundle.hpp"
#include "roslam/mapping/local_mapper.hpp"

namespace roslam {
namespace {

// A map at the truth: keyframes side by side that look along z at random points.
class BundleOfMap : public testing::Test {
 protected:
  static constexpr std::size_t kPoints = 60;

  KeyframeId add_keyframe(SubmapId submap = SubmapId{0}) {
    const double x = 0.1 * static_cast<double>(map_.keyframe_slots());
    auto view = std::make_shared<ObservedFrame>();
    view->pixels.resize(kPoints, Eigen::Vector2f::Zero());
    view->depths.resize(kPoints, 0.0F);
    view->levels.resize(kPoints, 0);
    view->angles.resize(kPoints, 0.0F);
    view->colours.resize(kPoints);
    view->descriptors.resize(kPoints);
    views_.push_back(view);
    next_point_.push_back(0);
    return map_.add_keyframe(map_.keyframe_slots(), x, SE3(Eigen::Quaterniond::Identity(), {-x, 0, 0}), view,
                             submap);
  }

  std::vector<KeyframeId> add_keyframes(int count) {
    std::vector<KeyframeId> result;
    for (int i = 0; i < count; ++i) result.push_back(add_keyframe());
    return result;
  }

  // Landmarks that exactly these keyframes see, at the next free point of each.
  std::vector<LandmarkId> add_landmarks(int count, const std::vector<KeyframeId>& observers) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<LandmarkId> result;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d position(uniform(random_), uniform(random_), 3.0 + uniform(random_));
      for (const KeyframeId id : observers) see(id, next_point_[id.index()], position);
      result.push_back(
          map_.add_landmark(position, observers.front(), next_point_[observers.front().index()]++));
      for (std::size_t k = 1; k < observers.size(); ++k)
        map_.add_observation(result.back(), observers[k], next_point_[observers[k].index()]++);
    }
    return result;
  }

  // Gives a point of a keyframe the measurement of that position.
  void see(KeyframeId id, std::uint32_t point, const Eigen::Vector3d& position) {
    const Eigen::Vector3d in_camera = map_.find(id)->T_camera_world * position;
    views_[id.index()]->pixels[point] = camera_.project(in_camera).cast<float>();
    views_[id.index()]->depths[point] = static_cast<float>(in_camera.z());
  }

  // Every observation by a pose of the problem is one term with its own measurement, and there are no others.
  template <typename Bundle>
  void expect_terms_of_map(const Bundle& bundle) const {
    std::size_t expected = 0;
    for (const LandmarkId id : bundle.landmarks) expected += map_.find(id)->observations.size();
    EXPECT_EQ(bundle.problem.terms.size(), expected);
    std::set<std::pair<std::size_t, std::size_t>> seen;
    for (const auto& term : bundle.problem.terms) {
      ASSERT_LT(term.pose, bundle.keyframes.size());
      ASSERT_LT(term.point, bundle.landmarks.size());
      EXPECT_TRUE(seen.emplace(term.pose, term.point).second);
      const Keyframe& keyframe = *map_.find(bundle.keyframes[term.pose]);
      const auto at =
          std::find(keyframe.landmarks.begin(), keyframe.landmarks.end(), bundle.landmarks[term.point]);
      ASSERT_NE(at, keyframe.landmarks.end());
      const auto point = static_cast<std::size_t>(at - keyframe.landmarks.begin());
      EXPECT_EQ(term.measurement.pixel, keyframe.view->pixels[point].template cast<double>());
      EXPECT_EQ(term.measurement.depth, static_cast<double>(keyframe.view->depths[point]));
    }
  }

  template <typename Bundle>
  static bool is_fixed(const Bundle& bundle, KeyframeId id) {
    const auto at = std::find(bundle.keyframes.begin(), bundle.keyframes.end(), id);
    EXPECT_NE(at, bundle.keyframes.end()) << "keyframe " << id.value << " is no part of it";
    return bundle.problem.poses[static_cast<std::size_t>(at - bundle.keyframes.begin())].is_fixed;
  }

  static bool is_at(const SE3& a, const SE3& b) { return (a * b.inverse()).log().norm() < 1e-9; }

  static SE3 small_motion() {
    return SE3::exp((Vector6d() << 0.02, -0.01, 0.03, 0.004, -0.006, 0.002).finished());
  }

  std::mt19937 random_{6};
  Camera camera_;
  MeasurementNoise noise_;
  Map map_{{1.0F, 1.2F}};
  MapMutex mutex_;
  std::vector<std::shared_ptr<ObservedFrame>> views_;
  std::vector<std::uint32_t> next_point_;
};

class LocalBundleTest : public BundleOfMap {
 protected:
  LocalBundle around(KeyframeId keyframe) const {
    return LocalBundle::around(map_, keyframe, noise_, {.window = 3, .min_shared = 5});
  }
};

TEST_F(LocalBundleTest, TakesTheWindowItsLandmarksAndTheirOtherObservers) {
  const auto k = add_keyframes(8);
  std::vector<LandmarkId> expected;
  const auto add = [&](int count, const std::vector<KeyframeId>& observers) {
    const auto added = add_landmarks(count, observers);
    expected.insert(expected.end(), added.begin(), added.end());
  };
  add(8, {k[4], k[6]});
  add(6, {k[1], k[3], k[6]});  // six that 1 and 3 share with 6 ...
  add(1, {k[3], k[6]});        // ... and one more of 3
  add(5, {k[5], k[6]});        // enough, but the window is full
  add(4, {k[0], k[6]});        // too few
  add(2, {k[2], k[4]});        // seen by the window only
  // None of these belongs to it: seen once, or not by the window.
  add_landmarks(3, {k[6]});
  add_landmarks(9, {k[2], k[5]});
  add_landmarks(3, {k[5], k[7]});

  const LocalBundle bundle = around(k[6]);
  ASSERT_EQ(bundle.keyframes.size(), bundle.problem.poses.size());
  ASSERT_EQ(bundle.landmarks.size(), bundle.problem.points.size());
  ASSERT_EQ(bundle.keyframes.size(), 7U);
  EXPECT_EQ(bundle.keyframes[0], k[6]);
  EXPECT_EQ(bundle.keyframes[1], k[4]);
  EXPECT_EQ(bundle.keyframes[2], k[3]);
  for (const std::size_t i : {6U, 4U, 3U}) EXPECT_FALSE(is_fixed(bundle, k[i])) << i;
  for (const std::size_t i : {0U, 1U, 2U, 5U}) EXPECT_TRUE(is_fixed(bundle, k[i])) << i;
  EXPECT_EQ(std::set(bundle.landmarks.begin(), bundle.landmarks.end()),
            std::set(expected.begin(), expected.end()));
  EXPECT_EQ(bundle.landmarks.size(), expected.size()) << "each once";
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    EXPECT_TRUE(
        is_at(bundle.problem.poses[i].T_camera_world, map_.find(bundle.keyframes[i])->T_camera_world));
  }
  for (std::size_t p = 0; p < bundle.landmarks.size(); ++p)
    EXPECT_EQ(bundle.problem.points[p], map_.find(bundle.landmarks[p])->position);
  expect_terms_of_map(bundle);
}

TEST_F(LocalBundleTest, FixesTheFirstKeyframeOfASubmap) {
  const auto k = add_keyframes(2);
  const KeyframeId origin_of_another = add_keyframe(SubmapId{1});
  const KeyframeId later_of_another = add_keyframe(SubmapId{1});
  add_landmarks(10, {k[0], k[1]});
  add_landmarks(10, {origin_of_another, later_of_another});
  const LocalBundle first = around(k[1]);
  EXPECT_EQ(first.keyframes.size(), 2U);
  EXPECT_TRUE(is_fixed(first, k[0]));
  EXPECT_FALSE(is_fixed(first, k[1]));
  EXPECT_TRUE(is_fixed(around(k[0]), k[0]));
  const LocalBundle second = around(later_of_another);
  EXPECT_EQ(second.keyframes.size(), 2U);
  EXPECT_TRUE(is_fixed(second, origin_of_another));
  EXPECT_FALSE(is_fixed(second, later_of_another));
}

TEST_F(LocalBundleTest, ALandmarkThatLostItsOtherObserverIsLeftOut) {
  const auto k = add_keyframes(3);
  add_landmarks(5, {k[0], k[2]});
  const LandmarkId landmark = add_landmarks(1, {k[1], k[2]}).front();
  EXPECT_EQ(around(k[2]).landmarks.size(), 6U);
  map_.remove_observation(landmark, k[1]);
  EXPECT_EQ(around(k[2]).landmarks.size(), 5U);
}

TEST_F(LocalBundleTest, BringsAKeyframeBackToTheTruth) {
  const auto k = add_keyframes(4);
  add_landmarks(30, k);
  const SE3 truth = map_.find(k[3])->T_camera_world;
  map_.find(k[3])->T_camera_world = small_motion() * truth;
  for (const LandmarkId id : map_.landmark_ids())
    map_.find(id)->position += Eigen::Vector3d(0.01, 0.01, -0.02);
  const BundleAdjustmentOptions options{.iterations = 20, .window = 3, .min_shared = 5};
  LocalBundle bundle = LocalBundle::around(map_, k[3], noise_, options);
  ASSERT_TRUE(adjust_bundle(camera_, bundle.problem, options).is_usable);
  const SE3 before = map_.find(k[3])->T_camera_world;
  bundle.apply_to(map_, camera_);
  EXPECT_GT((before * truth.inverse()).log().norm(), 0.03);
  EXPECT_LT((map_.find(k[3])->T_camera_world * truth.inverse()).log().norm(), 1e-3);
  for (const LandmarkId id : map_.landmark_ids()) EXPECT_EQ(map_.find(id)->observations.size(), 4U);
}

// Two keyframes and a bystander; a solution that moves all poses and points of the bundle a little, so that
// the measurements still fit.
class LocalBundleSolution : public LocalBundleTest {
 protected:
  void SetUp() override {
    k_ = add_keyframes(5);
    landmarks_ = add_landmarks(10, {k_[0], k_[2], k_[3]});
    elsewhere_ = add_landmarks(5, {k_[1], k_[4]});
    solution_ = around(k_[3]);
    for (auto& pose : solution_.problem.poses) pose.T_camera_world = motion_ * pose.T_camera_world;
    for (auto& point : solution_.problem.points) point += shift_;
    for (const KeyframeId id : k_) before_.push_back(map_.find(id)->T_camera_world);
    for (std::uint32_t i = 0; i < map_.landmark_slots(); ++i)
      positions_before_.push_back(map_.find(LandmarkId{i})->position);
  }

  bool has_moved(KeyframeId id) const {
    const SE3& now = map_.find(id)->T_camera_world;
    if (is_at(now, before_[id.index()])) return false;
    EXPECT_TRUE(is_at(now, motion_ * before_[id.index()]));
    return true;
  }

  bool has_moved(LandmarkId id) const {
    const Eigen::Vector3d moved = map_.find(id)->position - positions_before_[id.index()];
    if (moved.norm() == 0.0) return false;
    EXPECT_LT((moved - shift_).norm(), 1e-12);
    return true;
  }

  const SE3 motion_{Eigen::Quaterniond::Identity(), {0.001, -0.002, 0.001}};
  const Eigen::Vector3d shift_{0.001, 0.001, -0.002};
  std::vector<KeyframeId> k_;
  std::vector<LandmarkId> landmarks_;
  std::vector<LandmarkId> elsewhere_;
  LocalBundle solution_;
  std::vector<SE3> before_;
  std::vector<Eigen::Vector3d> positions_before_;
};

TEST_F(LocalBundleSolution, MovesWhatIsFreeInIt) {
  const Eigen::Vector3d normal_before = map_.find(landmarks_.front())->normal;
  solution_.apply_to(map_, camera_);
  EXPECT_TRUE(has_moved(k_[3]));
  EXPECT_TRUE(has_moved(k_[2]));
  EXPECT_FALSE(has_moved(k_[0])) << "fixed";
  EXPECT_FALSE(has_moved(k_[1]));
  EXPECT_FALSE(has_moved(k_[4]));
  for (const LandmarkId id : landmarks_) {
    EXPECT_TRUE(has_moved(id));
    EXPECT_EQ(map_.find(id)->observations.size(), 3U);
  }
  for (const LandmarkId id : elsewhere_) EXPECT_FALSE(has_moved(id));
  EXPECT_GT((map_.find(landmarks_.front())->normal - normal_before).norm(), 0.0) << "normals follow";
}

TEST_F(LocalBundleSolution, LeavesAloneWhatWasRemovedMeanwhile) {
  map_.remove_keyframe(k_[2], k_[0]);
  map_.remove_landmark(landmarks_[4]);
  map_.merge_landmarks(landmarks_[5], landmarks_[6]);
  const SE3 removed_before = map_.T_camera_world(k_[2]);
  solution_.apply_to(map_, camera_);
  EXPECT_EQ(map_.find(k_[2]), nullptr);
  EXPECT_TRUE(is_at(map_.T_camera_world(k_[2]), removed_before)) << "it follows its anchor, which is fixed";
  EXPECT_EQ(map_.find(landmarks_[4]), nullptr);
  EXPECT_EQ(map_.find(landmarks_[5]), nullptr);
  EXPECT_EQ(map_.resolve(landmarks_[5]), landmarks_[6]);
  EXPECT_TRUE(has_moved(k_[3]));
  for (const LandmarkId id : landmarks_) {
    if (map_.find(id) == nullptr) continue;
    EXPECT_TRUE(has_moved(id));
    EXPECT_EQ(map_.find(id)->observations.size(), 2U);
  }
}

TEST_F(LocalBundleSolution, LeavesAloneWhatWasAddedMeanwhile) {
  const KeyframeId added = add_keyframe();
  const SE3 pose = map_.find(added)->T_camera_world;
  map_.add_observation(landmarks_[0], added, 0);
  const LandmarkId new_landmark = add_landmarks(1, {k_[3], added}).front();
  const Eigen::Vector3d position = map_.find(new_landmark)->position;
  solution_.apply_to(map_, camera_);
  EXPECT_TRUE(is_at(map_.find(added)->T_camera_world, pose));
  EXPECT_EQ(map_.find(new_landmark)->position, position);
  EXPECT_EQ(map_.find(landmarks_[0])->observations.size(), 4U);
  EXPECT_TRUE(has_moved(landmarks_[0]));
}

TEST_F(LocalBundleSolution, RemovesOutlierObservationsOnly) {
  const auto fitting = std::find_if(
      solution_.problem.terms.begin(), solution_.problem.terms.end(), [&](const BundleProblem::Term& term) {
        return solution_.keyframes[term.pose] == k_[2] && solution_.landmarks[term.point] == landmarks_[7];
      });
  ASSERT_NE(fitting, solution_.problem.terms.end());
  fitting->measurement.pixel.x() += 100.0;
  solution_.apply_to(map_, camera_);
  for (const LandmarkId id : landmarks_)
    EXPECT_EQ(map_.find(id)->observations.size(), id == landmarks_[7] ? 2U : 3U);
  EXPECT_TRUE(std::none_of(map_.find(k_[2])->landmarks.begin(), map_.find(k_[2])->landmarks.end(),
                           [&](LandmarkId id) { return id == landmarks_[7]; }));
}

class GlobalBundleTest : public BundleOfMap {};

TEST_F(GlobalBundleTest, TakesAllKeyframesAndTheLandmarksThatSeveralSee) {
  const auto k = add_keyframes(4);
  const KeyframeId origin_of_another = add_keyframe(SubmapId{1});
  const KeyframeId later_of_another = add_keyframe(SubmapId{1});
  auto expected = add_landmarks(5, {k[0], k[1], k[3]});
  const auto pairs = add_landmarks(3, {origin_of_another, later_of_another});
  expected.insert(expected.end(), pairs.begin(), pairs.end());
  add_landmarks(4, {k[3]});        // seen once
  add_landmarks(2, {k[2], k[3]});  // seen once after the next line
  map_.remove_keyframe(k[2], k[1]);
  const GlobalBundle bundle = GlobalBundle::of(map_, mutex_, noise_);
  EXPECT_EQ(bundle.keyframes, map_.keyframe_ids());
  ASSERT_EQ(bundle.problem.poses.size(), 5U);
  EXPECT_EQ(bundle.landmarks, expected);
  ASSERT_EQ(bundle.problem.points.size(), expected.size());
  for (std::size_t p = 0; p < expected.size(); ++p)
    EXPECT_EQ(bundle.problem.points[p], map_.find(expected[p])->position);
  EXPECT_TRUE(is_fixed(bundle, k[0]));
  EXPECT_FALSE(is_fixed(bundle, k[1]));
  EXPECT_FALSE(is_fixed(bundle, k[3]));
  EXPECT_TRUE(is_fixed(bundle, origin_of_another));
  EXPECT_FALSE(is_fixed(bundle, later_of_another));
  expect_terms_of_map(bundle);
}

// The map is read a few hundred landmarks at a time.
TEST_F(GlobalBundleTest, ReadsLargeMapsInParts) {
  std::vector<LandmarkId> expected;
  for (int pair = 0; pair < 25; ++pair) {
    const auto k = add_keyframes(2);
    const auto seen_twice = add_landmarks(47, k);
    expected.insert(expected.end(), seen_twice.begin(), seen_twice.end());
    add_landmarks(3, {k[0]});
  }
  ASSERT_GT(expected.size(), 1000U);
  const GlobalBundle bundle = GlobalBundle::of(map_, mutex_, noise_);
  EXPECT_EQ(bundle.landmarks, expected);
  expect_terms_of_map(bundle);
}

TEST_F(GlobalBundleTest, ItsCorrectionMovesTheMapToTheSolution) {
  const auto k = add_keyframes(3);
  const auto landmarks = add_landmarks(6, k);
  const LandmarkId seen_once = add_landmarks(1, {k[1]}).front();
  GlobalBundle bundle = GlobalBundle::of(map_, mutex_, noise_);
  const BundleProblem before = bundle.problem;
  for (std::size_t i = 1; i < k.size(); ++i)
    bundle.problem.poses[i].T_camera_world = small_motion() * before.poses[i].T_camera_world;
  for (std::size_t p = 0; p < landmarks.size(); ++p)
    bundle.problem.points[p] += Eigen::Vector3d(0.01 * static_cast<double>(p), 0.02, -0.03);
  const Eigen::Vector3d in_camera = map_.find(k[1])->T_camera_world * map_.find(seen_once)->position;
  const MapCorrection correction = bundle.correction(before);
  ASSERT_EQ(correction.positions.size(), landmarks.size());
  EXPECT_EQ(correction.T_old_new.size(), k.size());
  correction.apply_to(map_);
  for (std::size_t i = 0; i < k.size(); ++i)
    EXPECT_TRUE(is_at(map_.find(k[i])->T_camera_world, bundle.problem.poses[i].T_camera_world));
  EXPECT_TRUE(is_at(map_.find(k[0])->T_camera_world, before.poses[0].T_camera_world));
  for (std::size_t p = 0; p < landmarks.size(); ++p)
    EXPECT_LT((map_.find(landmarks[p])->position - bundle.problem.points[p]).norm(), 1e-12);
  // One that the bundle does not hold moves with the keyframe that sees it.
  EXPECT_LT((map_.find(k[1])->T_camera_world * map_.find(seen_once)->position - in_camera).norm(), 1e-12);
}

TEST_F(GlobalBundleTest, ItsCorrectionLeavesAloneWhatWasRemovedMeanwhile) {
  const auto k = add_keyframes(3);
  const auto landmarks = add_landmarks(6, k);
  GlobalBundle bundle = GlobalBundle::of(map_, mutex_, noise_);
  const BundleProblem before = bundle.problem;
  for (std::size_t i = 1; i < k.size(); ++i)
    bundle.problem.poses[i].T_camera_world = small_motion() * before.poses[i].T_camera_world;
  for (auto& point : bundle.problem.points) point.y() += 0.02;
  map_.remove_keyframe(k[1], k[0]);
  map_.remove_landmark(landmarks[2]);
  bundle.correction(before).apply_to(map_);
  EXPECT_EQ(map_.find(k[1]), nullptr);
  EXPECT_EQ(map_.find(landmarks[2]), nullptr);
  EXPECT_TRUE(is_at(map_.T_camera_world(k[1]), before.poses[1].T_camera_world)) << "its anchor did not move";
  EXPECT_TRUE(is_at(map_.find(k[2])->T_camera_world, bundle.problem.poses[2].T_camera_world));
  for (std::size_t p = 0; p < landmarks.size(); ++p) {
    if (p == 2) continue;
    EXPECT_LT((map_.find(landmarks[p])->position - bundle.problem.points[p]).norm(), 1e-12);
  }
}

TEST_F(GlobalBundleTest, BringsTheMapBackToTheTruth) {
  const auto k = add_keyframes(5);
  add_landmarks(30, k);
  std::vector<SE3> truth;
  for (const KeyframeId id : k) truth.push_back(map_.find(id)->T_camera_world);
  for (std::size_t i = 1; i < k.size(); ++i) map_.find(k[i])->T_camera_world = small_motion() * truth[i];
  GlobalBundle bundle = GlobalBundle::of(map_, mutex_, noise_);
  const BundleProblem before = bundle.problem;
  ASSERT_TRUE(adjust_bundle(camera_, bundle.problem, {.iterations = 20}).is_usable);
  bundle.correction(before).apply_to(map_);
  for (std::size_t i = 0; i < k.size(); ++i)
    EXPECT_LT((map_.find(k[i])->T_camera_world * truth[i].inverse()).log().norm(), 1e-3);
}

}  // namespace
}  // namespace roslam
