// SPDX-License-Identifier: BSD-3-Clause
// Ids, anchors, merging and appending.
#include "roslam/map/map.hpp"
#include "roslam/map/map_parts.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

constexpr std::size_t kPoints = 20;

KeyframeId add_keyframe(Map& map, double x, SubmapId submap = SubmapId{0}) {
  auto view = std::make_shared<ObservedFrame>();
  for (std::uint64_t i = 0; i < kPoints; ++i) {
    view->pixels.emplace_back(10.0F * static_cast<float>(i), 100.0F);
    view->depths.push_back(2.0F);
    view->levels.push_back(0);
    view->angles.push_back(0.0F);
    view->colours.emplace_back(1, 2, 3);
    view->descriptors.push_back({i, i * i, 0, 0});
  }
  const SE3 T_camera_world = SE3::exp((Vector6d() << x, 0.1 * x, 0.0, 0.0, 0.2 * x, 0.0).finished());
  return map.add_keyframe(map.keyframe_slots(), x, T_camera_world, view, submap);
}

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

// Both sides of every observation agree, and observations are ordered by keyframe.
void expect_consistent(const Map& map) {
  std::size_t observations = 0;
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.find(id);
    EXPECT_EQ(landmark.id, id);
    KeyframeId last;
    for (const Observation& observation : landmark.observations) {
      if (last.is_valid()) {
        EXPECT_LT(last, observation.keyframe);
      }
      last = observation.keyframe;
      ASSERT_NE(map.find(observation.keyframe), nullptr);
      EXPECT_EQ(map.find(observation.keyframe)->landmarks[observation.point], id);
      ++observations;
    }
    EXPECT_NE(map.find(landmark.created_by), nullptr);
  }
  for (const KeyframeId id : map.keyframe_ids()) {
    EXPECT_EQ(map.find(id)->id, id);
    for (const LandmarkId landmark : map.find(id)->landmarks) observations -= landmark.is_valid() ? 1 : 0;
  }
  EXPECT_EQ(observations, 0U);
}

class MapOfIds : public testing::Test {
 protected:
  SE3 relative(KeyframeId a, KeyframeId b) const {
    return map_.T_camera_world(a) * map_.T_camera_world(b).inverse();
  }

  static void expect_same(const SE3& a, const SE3& b) { EXPECT_LT((a.matrix() - b.matrix()).norm(), 1e-12); }

  Map map_{{1.0F, 1.2F, 1.44F}};
};

TEST_F(MapOfIds, KeyframesThatNeverWereHaveNoPose) {
  const auto expect_refused = [&](KeyframeId id, const std::string& word) {
    for (const auto& message :
         {refusal([&] { map_.T_camera_anchor(id); }), refusal([&] { map_.T_camera_world(id); }),
          refusal([&] { map_.submap_of(id); })}) {
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  };
  expect_refused(KeyframeId{}, "invalid");
  expect_refused(KeyframeId{0}, "0");
  const KeyframeId id = add_keyframe(map_, 0.0, SubmapId{3});
  expect_refused(KeyframeId{}, "invalid");
  expect_refused(KeyframeId{id.value + 1}, std::to_string(id.value + 1));
  expect_refused(KeyframeId{KeyframeId::kNone - 1}, std::to_string(KeyframeId::kNone - 1));
  EXPECT_EQ(map_.T_camera_anchor(id).first, id);
  expect_same(map_.T_camera_anchor(id).second, SE3());
  expect_same(map_.T_camera_world(id), map_.find(id)->T_camera_world);
  EXPECT_EQ(map_.submap_of(id), SubmapId{3});
}

TEST_F(MapOfIds, WhatNeverWasOrIsNoMoreIsNotFound) {
  const Map& constant = map_;
  EXPECT_EQ(map_.find(KeyframeId{}), nullptr);
  EXPECT_EQ(map_.find(LandmarkId{}), nullptr);
  EXPECT_EQ(constant.find(KeyframeId{0}), nullptr);
  EXPECT_EQ(constant.find(LandmarkId{0}), nullptr);
  const KeyframeId a = add_keyframe(map_, 0.0);
  const KeyframeId b = add_keyframe(map_, 0.5);
  const LandmarkId landmark = map_.add_landmark({0, 0, 2}, a, 3);
  EXPECT_EQ(map_.find(b)->id, b);
  EXPECT_EQ(constant.find(landmark)->id, landmark);
  map_.remove_keyframe(b, a);
  map_.remove_landmark(landmark);
  EXPECT_EQ(map_.find(b), nullptr);
  EXPECT_EQ(constant.find(b), nullptr);
  EXPECT_EQ(map_.find(landmark), nullptr);
  EXPECT_EQ(constant.find(landmark), nullptr);
  EXPECT_EQ(map_.find(KeyframeId{b.value + 1}), nullptr);
  EXPECT_EQ(map_.find(LandmarkId{landmark.value + 1}), nullptr);
}

TEST_F(MapOfIds, NoIdIsGivenTwice) {
  const KeyframeId a = add_keyframe(map_, 0.0);
  const KeyframeId b = add_keyframe(map_, 0.5);
  const LandmarkId landmark = map_.add_landmark({0, 0, 2}, a, 3);
  map_.remove_keyframe(b, a);
  map_.remove_landmark(landmark);
  EXPECT_EQ(add_keyframe(map_, 1.0), KeyframeId{b.value + 1});
  EXPECT_EQ(map_.add_landmark({0, 0, 2}, a, 3), LandmarkId{landmark.value + 1});
  EXPECT_EQ(map_.keyframe_count(), 2U);
  EXPECT_EQ(map_.landmark_count(), 1U);
}

TEST_F(MapOfIds, ResolvingTakesAnyId) {
  EXPECT_FALSE(map_.resolve(LandmarkId{}).is_valid());
  EXPECT_EQ(map_.resolve(LandmarkId{7}), LandmarkId{7});
  EXPECT_EQ(map_.find(map_.resolve(LandmarkId{7})), nullptr);
  const LandmarkId landmark = map_.add_landmark({0, 0, 2}, add_keyframe(map_, 0.0), 3);
  EXPECT_FALSE(map_.resolve(LandmarkId{}).is_valid());
  EXPECT_EQ(map_.resolve(LandmarkId{7}), LandmarkId{7});
  EXPECT_EQ(map_.resolve(landmark), landmark);
  map_.remove_landmark(landmark);
  EXPECT_EQ(map_.resolve(landmark), landmark) << "removed, not merged";
}

TEST_F(MapOfIds, CallsWithIdsThatDoNotExistChangeNothing) {
  const KeyframeId a = add_keyframe(map_, 0.0);
  const LandmarkId landmark = map_.add_landmark({0, 0, 2}, a, 3);
  for (const LandmarkId id : {LandmarkId{}, LandmarkId{9}}) {
    EXPECT_FALSE(map_.add_observation(id, a, 4));
    map_.remove_observation(id, a);
    map_.remove_landmark(id);
    map_.merge_landmarks(id, landmark);
    map_.merge_landmarks(landmark, id);
    map_.refresh(id);
    map_.refresh_geometry(id);
  }
  map_.merge_landmarks(landmark, landmark);
  for (const KeyframeId id : {KeyframeId{}, KeyframeId{9}}) {
    EXPECT_FALSE(map_.add_observation(landmark, id, 4));
    map_.remove_observation(landmark, id);
    map_.remove_keyframe(id, a);
    map_.remove_keyframe(a, id);
    EXPECT_TRUE(map_.covisible(id).empty());
  }
  EXPECT_EQ(map_.keyframe_count(), 1U);
  EXPECT_EQ(map_.landmark_count(), 1U);
  EXPECT_EQ(map_.find(a)->landmarks[3], landmark);
  EXPECT_FALSE(map_.find(a)->landmarks[4].is_valid());
  expect_consistent(map_);
}

TEST_F(MapOfIds, PosesOfRemovedKeyframesFollowAChainOfAnchors) {
  std::vector<KeyframeId> k;
  for (int i = 0; i < 5; ++i) k.push_back(add_keyframe(map_, 0.3 * i, SubmapId{2}));
  std::vector<SE3> from_first;
  for (const KeyframeId id : k) from_first.push_back(relative(id, k[0]));
  map_.remove_keyframe(k[3], k[2]);
  map_.remove_keyframe(k[4], k[2]);
  map_.remove_keyframe(k[2], k[1]);
  map_.remove_keyframe(k[1], k[0]);
  for (std::size_t i = 0; i < k.size(); ++i) {
    EXPECT_EQ(map_.T_camera_anchor(k[i]).first, k[0]);
    expect_same(map_.T_camera_anchor(k[i]).second, from_first[i]);
    expect_same(relative(k[i], k[0]), from_first[i]);
  }
  map_.find(k[0])->T_camera_world = SE3::exp((Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  for (std::size_t i = 0; i < k.size(); ++i)
    expect_same(map_.T_camera_world(k[i]), from_first[i] * map_.find(k[0])->T_camera_world);
  map_.merge_submaps(SubmapId{2}, SubmapId{0});
  for (const KeyframeId id : k) EXPECT_EQ(map_.submap_of(id), SubmapId{0});
}

TEST_F(MapOfIds, AnAnchorHoldsTheRelativePoseOfWhenAKeyframeWasRemoved) {
  const KeyframeId a = add_keyframe(map_, 0.0);
  const KeyframeId b = add_keyframe(map_, 0.3);
  const KeyframeId c = add_keyframe(map_, 0.6);
  map_.find(b)->T_camera_world = SE3::exp((Vector6d() << 0.1, 0, 0, 0, 0.1, 0).finished());
  const SE3 b_from_a = relative(b, a);
  map_.remove_keyframe(c, b);
  const SE3 c_from_b = relative(c, b);
  map_.find(b)->T_camera_world = SE3::exp((Vector6d() << 0.3, 0.2, 0, 0, 0.1, 0.1).finished());
  expect_same(relative(c, b), c_from_b);
  const SE3 b_moved_from_a = relative(b, a);
  EXPECT_GT((b_moved_from_a.matrix() - b_from_a.matrix()).norm(), 0.1);
  map_.remove_keyframe(b, a);
  expect_same(relative(b, a), b_moved_from_a);
  expect_same(relative(c, a), c_from_b * b_moved_from_a);
}

TEST_F(MapOfIds, MergedLandmarksForwardToTheLast) {
  const KeyframeId a = add_keyframe(map_, 0.0);
  const KeyframeId b = add_keyframe(map_, 0.1);
  const KeyframeId c = add_keyframe(map_, 0.2);
  const LandmarkId first = map_.add_landmark({0, 0, 2}, a, 1);
  const LandmarkId second = map_.add_landmark({0, 0, 2}, b, 2);
  const LandmarkId third = map_.add_landmark({0, 0, 2}, c, 3);
  map_.find(first)->times_found = 4;
  map_.find(second)->times_found = 5;
  map_.find(third)->times_found = 6;
  map_.merge_landmarks(first, second);
  EXPECT_EQ(map_.resolve(first), second);
  map_.merge_landmarks(second, third);
  EXPECT_EQ(map_.resolve(first), third);
  EXPECT_EQ(map_.resolve(second), third);
  EXPECT_EQ(map_.find(third)->observations.size(), 3U);
  EXPECT_EQ(map_.find(third)->times_found, 15U);
  EXPECT_EQ(map_.find(a)->landmarks[1], third);
  EXPECT_EQ(map_.landmark_count(), 1U);
  expect_consistent(map_);
  map_.merge_landmarks(first, third);
  EXPECT_EQ(map_.find(third)->times_found, 15U) << "the first is no more";
  map_.remove_landmark(third);
  EXPECT_EQ(map_.resolve(first), third);
  EXPECT_EQ(map_.find(map_.resolve(first)), nullptr);
}

TEST_F(MapOfIds, WhereOneKeyframeSawBothItSeesTheMergedLandmarkOnce) {
  const KeyframeId a = add_keyframe(map_, 0.0);
  const KeyframeId b = add_keyframe(map_, 0.1);
  const LandmarkId from = map_.add_landmark({0, 0, 2}, a, 1);
  map_.add_observation(from, b, 2);
  const LandmarkId into = map_.add_landmark({0, 0, 2}, a, 3);
  map_.merge_landmarks(from, into);
  EXPECT_FALSE(map_.find(a)->landmarks[1].is_valid());
  EXPECT_EQ(map_.find(a)->landmarks[3], into);
  EXPECT_EQ(map_.find(b)->landmarks[2], into);
  EXPECT_EQ(map_.find(into)->observations.size(), 2U);
  expect_consistent(map_);
}

class AppendedMap : public MapOfIds {
 protected:
  // Submaps 0, 2 and 5; sessions 0 and 2; a keyframe and a landmark are removed.
  AppendedMap() {
    for (int i = 0; i < 3; ++i) k_.push_back(add_keyframe(other_, 0.2 * i));
    k_.push_back(add_keyframe(other_, 1.0, SubmapId{2}));
    other_.begin_session();
    other_.begin_session();
    k_.push_back(add_keyframe(other_, 1.5, SubmapId{5}));
    k_.push_back(add_keyframe(other_, 1.6, SubmapId{5}));
    other_.remove_landmark(other_.add_landmark({1, 0, 2}, k_[0], 0));
    landmark_ = other_.add_landmark({0.5, 0.1, 2}, k_[1], 4);
    other_.add_observation(landmark_, k_[0], 5);
    other_.add_observation(landmark_, k_[2], 6);
    other_.add_loop(k_[1], k_[4], SE3::exp((Vector6d() << 1, 0, 0, 0, 0.5, 0).finished()));
    other_.remove_keyframe(k_[1], k_[0]);
  }

  // The keyframe of map_ that is a copy of that one.
  KeyframeId copy_of(KeyframeId id) const {
    for (const KeyframeId candidate : map_.keyframe_ids()) {
      if (map_.find(candidate)->view == other_.find(id)->view) return candidate;
    }
    return {};
  }

  Map other_{{1.0F, 1.2F, 1.44F}};
  std::vector<KeyframeId> k_;
  LandmarkId landmark_;
};

TEST_F(AppendedMap, GetsNewNumbersAfterThoseThatExist) {
  add_keyframe(map_, 0.0);
  map_.begin_session();
  const KeyframeId ours = add_keyframe(map_, 0.0, SubmapId{1});
  map_.add_landmark({0, 0, 2}, ours, 0);
  map_.append(MapParts::of(other_));
  EXPECT_EQ(map_.keyframe_count(), 2U + 5U);
  EXPECT_EQ(map_.keyframe_slots(), 2U + 5U) << "without gaps";
  EXPECT_EQ(map_.landmark_count(), 2U);
  EXPECT_EQ(map_.landmark_slots(), 2U) << "without gaps";
  EXPECT_EQ(map_.submaps(), (std::vector<SubmapId>{{0}, {1}, {2}, {3}, {4}}));
  EXPECT_EQ(map_.find(copy_of(k_[0]))->submap, SubmapId{2});
  EXPECT_EQ(map_.find(copy_of(k_[2]))->submap, SubmapId{2});
  EXPECT_EQ(map_.find(copy_of(k_[3]))->submap, SubmapId{3});
  EXPECT_EQ(map_.find(copy_of(k_[5]))->submap, SubmapId{4});
  EXPECT_EQ(map_.find(copy_of(k_[3]))->session, 2U);
  EXPECT_EQ(map_.find(copy_of(k_[5]))->session, 3U);
  EXPECT_EQ(map_.find(ours)->session, 1U);
  // What follows continues the numbering.
  EXPECT_EQ(map_.new_submap(), SubmapId{5});
  EXPECT_EQ(map_.session(), 3U);
  EXPECT_EQ(add_keyframe(map_, 0.0), KeyframeId{7});
  expect_consistent(map_);
}

TEST_F(AppendedMap, StartsAtZeroInAnEmptyMap) {
  map_.append(MapParts::of(other_));
  EXPECT_EQ(map_.submaps(), (std::vector<SubmapId>{{0}, {1}, {2}}));
  EXPECT_EQ(map_.keyframe_ids(), (std::vector<KeyframeId>{{0}, {1}, {2}, {3}, {4}}));
  EXPECT_EQ(map_.find(KeyframeId{0})->session, 0U);
  EXPECT_EQ(map_.find(KeyframeId{4})->session, 1U);
  expect_consistent(map_);
}

TEST_F(AppendedMap, KeepsPosesObservationsAndLoops) {
  for (const double x : {0.0, 0.1, 0.2}) add_keyframe(map_, x);
  map_.append(MapParts::of(other_));
  for (const KeyframeId id : other_.keyframe_ids()) {
    const Keyframe& copy = *map_.find(copy_of(id));
    expect_same(copy.T_camera_world, other_.find(id)->T_camera_world);
    EXPECT_EQ(copy.timestamp, other_.find(id)->timestamp);
    EXPECT_EQ(copy.frame_index, other_.find(id)->frame_index);
  }
  const LandmarkId id = map_.find(copy_of(k_[0]))->landmarks[5];
  ASSERT_NE(map_.find(id), nullptr);
  const Landmark& landmark = *map_.find(id);
  EXPECT_EQ(landmark.position, other_.find(landmark_)->position);
  EXPECT_EQ(landmark.descriptor, other_.find(landmark_)->descriptor);
  EXPECT_EQ(landmark.observations.size(), 2U);
  EXPECT_EQ(map_.find(copy_of(k_[2]))->landmarks[6], id);
  EXPECT_EQ(landmark.created_by, copy_of(k_[0])) << "the anchor of the removed one that created it";
  ASSERT_EQ(other_.loops().size(), 1U);
  ASSERT_EQ(map_.loops().size(), 1U);
  EXPECT_EQ(map_.loops().front().from, copy_of(k_[0]));
  EXPECT_EQ(map_.loops().front().to, copy_of(k_[4]));
  expect_same(map_.loops().front().T_to_from, other_.loops().front().T_to_from);
  expect_consistent(map_);
}

TEST_F(AppendedMap, LeavesOutSubmaps) {
  const SubmapId without = other_.find(k_[0])->submap;
  map_.append(MapParts::of(other_, {without}));
  std::size_t others = 0;
  for (const KeyframeId id : other_.keyframe_ids()) {
    const bool is_left_out = other_.find(id)->submap == without;
    EXPECT_EQ(copy_of(id).is_valid(), !is_left_out);
    others += is_left_out ? 0 : 1;
  }
  EXPECT_EQ(map_.keyframe_count(), others);
  EXPECT_EQ(map_.landmark_count(), 0U) << "all landmarks are of that submap";
  EXPECT_TRUE(map_.loops().empty()) << "the loop leads to it";
  expect_consistent(map_);
}

TEST_F(AppendedMap, MayBeEmpty) {
  const KeyframeId ours = add_keyframe(map_, 0.0);
  map_.append(MapParts::of(Map({1.0F, 1.2F, 1.44F})));
  EXPECT_EQ(map_.keyframe_ids(), std::vector<KeyframeId>{ours});
  EXPECT_EQ(map_.session(), 0U);
  EXPECT_EQ(map_.new_submap(), SubmapId{1});
}

}  // namespace
}  // namespace roslam
