// SPDX-License-Identifier: BSD-3-Clause
// Poses of keyframes as threads of lower priority read them.
#include "roslam/map/keyframe_pose_table.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

SE3 at(double x, double angle = 0.0) { return SE3(so3_exp({0.0, angle, 0.0}), {x, 2.0 * x, -x}); }

double distance(const SE3& a, const SE3& b) {
  const SE3 difference = a.inverse() * b;
  return difference.translation().norm() + difference.angle();
}

class PoseTable : public testing::Test {
 protected:
  // T_world_camera: of the keyframe.
  KeyframeId add_keyframe(const SE3& T_world_camera, SubmapId submap = SubmapId{0}) {
    return map_.add_keyframe(map_.keyframe_slots(), 0.1 * static_cast<double>(map_.keyframe_slots()),
                             T_world_camera.inverse(), std::make_shared<ObservedFrame>(), submap);
  }

  void move(KeyframeId id, const SE3& T_world_camera) {
    map_.find(id)->T_camera_world = T_world_camera.inverse();
  }

  void expect_pose(KeyframeId id, const SE3& T_world_camera, SubmapId submap = SubmapId{0}) const {
    const auto found = table_.find({id});
    ASSERT_EQ(found.size(), 1U);
    EXPECT_LT(distance(found.front().T_world_camera, T_world_camera), 1e-9) << id.value;
    EXPECT_EQ(found.front().submap, submap) << id.value;
  }

  Map map_{std::vector<float>{1.0F}};
  KeyframePoseTable table_;
};

TEST_F(PoseTable, GivesPosesInTheOrderAskedFor) {
  const KeyframeId a = add_keyframe(at(1.0, 0.3));
  const KeyframeId b = add_keyframe(at(2.0, -0.2), SubmapId{1});
  const KeyframeId c = add_keyframe(at(3.0));
  table_.publish(map_);
  const auto found = table_.find({c, a, b, a});
  ASSERT_EQ(found.size(), 4U);
  EXPECT_LT(distance(found[0].T_world_camera, at(3.0)), 1e-9);
  EXPECT_LT(distance(found[1].T_world_camera, at(1.0, 0.3)), 1e-9);
  EXPECT_LT(distance(found[2].T_world_camera, at(2.0, -0.2)), 1e-9);
  EXPECT_LT(distance(found[3].T_world_camera, at(1.0, 0.3)), 1e-9);
  EXPECT_EQ(found[0].submap, SubmapId{0});
  EXPECT_EQ(found[2].submap, SubmapId{1});
  EXPECT_TRUE(table_.find({}).empty());
}

TEST_F(PoseTable, ThrowsForAKeyframeThatWasNotPublished) {
  EXPECT_TRUE(table_.find({}).empty());
  const KeyframeId a = add_keyframe(at(1.0));
  EXPECT_THROW(table_.find({a}), UsageError);  // it is in the map, but was not published
  table_.publish(map_);
  EXPECT_NO_THROW(table_.find({a}));
  EXPECT_THROW(table_.find({KeyframeId{1}}), UsageError);
  EXPECT_THROW(table_.find({a, KeyframeId{1}}), UsageError);
  EXPECT_THROW(table_.find({KeyframeId{}}), UsageError);
  table_.add(map_, add_keyframe(at(2.0)));
  EXPECT_NO_THROW(table_.find({a, KeyframeId{1}}));
}

TEST_F(PoseTable, AddingAKeyframeLeavesTheOthersAsTheyWerePublished) {
  const KeyframeId a = add_keyframe(at(1.0));
  table_.add(map_, a);
  move(a, at(5.0));
  const KeyframeId b = add_keyframe(at(2.0), SubmapId{3});
  table_.add(map_, b);
  expect_pose(a, at(1.0));
  expect_pose(b, at(2.0), SubmapId{3});
  table_.publish(map_);
  expect_pose(a, at(5.0));
  expect_pose(b, at(2.0), SubmapId{3});
}

// After a loop closure a table of old and new poses would place images in two different maps.
TEST_F(PoseTable, AddingAKeyframeAfterACorrectionPublishesAll) {
  const KeyframeId a = add_keyframe(at(1.0));
  table_.add(map_, a);
  move(a, at(5.0));
  map_.note_correction();
  const KeyframeId b = add_keyframe(at(6.0));
  table_.add(map_, b);
  expect_pose(a, at(5.0));
  expect_pose(b, at(6.0));
}

TEST_F(PoseTable, AddingAKeyframePublishesThoseBeforeItThatWereNot) {
  const KeyframeId a = add_keyframe(at(1.0));
  const KeyframeId b = add_keyframe(at(2.0));
  const KeyframeId c = add_keyframe(at(3.0));
  table_.add(map_, c);
  expect_pose(a, at(1.0));
  expect_pose(b, at(2.0));
  expect_pose(c, at(3.0));
}

TEST_F(PoseTable, ChangesOfTheMapAreSeenOnceTheyArePublished) {
  const KeyframeId a = add_keyframe(at(1.0));
  const KeyframeId b = add_keyframe(at(2.0), SubmapId{1});
  table_.publish(map_);
  const auto before = table_.find({a, b});
  move(a, at(7.0, 0.5));
  map_.merge_submaps(SubmapId{1}, SubmapId{0});
  expect_pose(a, at(1.0));
  expect_pose(b, at(2.0), SubmapId{1});
  table_.publish(map_);
  expect_pose(a, at(7.0, 0.5));
  expect_pose(b, at(2.0), SubmapId{0});
  EXPECT_LT(distance(before[0].T_world_camera, at(1.0)), 1e-9);  // what was handed out does not change
  EXPECT_EQ(before[1].submap, SubmapId{1});
}

TEST_F(PoseTable, ARemovedKeyframeFollowsItsAnchor) {
  const SubmapId submap{2};
  const KeyframeId a = add_keyframe(at(1.0, 0.4), submap);
  const KeyframeId b = add_keyframe(at(2.0, 0.1), submap);
  const KeyframeId c = add_keyframe(at(3.0, -0.6), submap);
  table_.publish(map_);
  map_.remove_keyframe(b, a);
  map_.remove_keyframe(a, c);
  table_.publish(map_);
  expect_pose(a, at(1.0, 0.4), submap);
  expect_pose(b, at(2.0, 0.1), submap);
  const SE3 correction(so3_exp({0.1, -0.7, 0.3}), {4.0, 5.0, 6.0});
  move(c, correction * at(3.0, -0.6));
  table_.publish(map_);
  expect_pose(a, correction * at(1.0, 0.4), submap);
  expect_pose(b, correction * at(2.0, 0.1), submap);
  expect_pose(c, correction * at(3.0, -0.6), submap);
  table_.add(map_, add_keyframe(at(9.0), submap));
  expect_pose(b, correction * at(2.0, 0.1), submap);
}

// In each state that is published all keyframes are at the same place, which moves on from state to state.
TEST_F(PoseTable, ReadersGetAllPosesFromOneStateWhileOthersArePublished) {
  constexpr std::uint32_t kKeyframes = 40;
  constexpr int kStates = 400;
  std::vector<KeyframeId> first_ten;
  for (std::uint32_t i = 0; i < 10; ++i) first_ten.push_back(add_keyframe(at(0.0)));
  table_.publish(map_);
  std::atomic<bool> is_published = false;
  std::atomic<std::uint32_t> published = 10;  // keyframes
  std::atomic<int> reading = 0;
  {
    std::vector<std::jthread> readers;
    for (int reader = 0; reader < 3; ++reader) {
      readers.emplace_back([&] {
        double last = -1.0;
        bool is_last = false;
        do {
          is_last = is_published;
          std::vector<KeyframeId> ids;
          for (std::uint32_t i = 0; i < published; ++i) ids.push_back(KeyframeId{i});
          const auto found = table_.find(ids);
          ASSERT_EQ(found.size(), ids.size());
          const double x = found.front().T_world_camera.translation().x();
          for (std::size_t i = 0; i < first_ten.size(); ++i)
            ASSERT_EQ(found[i].T_world_camera.translation().x(), x);
          ASSERT_GE(x, last);
          last = x;
          if (reading < 3) ++reading;
        } while (!is_last);
        EXPECT_EQ(last, kStates);
      });
    }
    while (reading < 3) std::this_thread::yield();
    for (int state = 1; state <= kStates; ++state) {
      if (state % 10 == 0 && map_.keyframe_slots() < kKeyframes) {
        table_.add(map_, add_keyframe(at(0.0)));
        ++published;
      }
      for (const KeyframeId id : first_ten) move(id, at(state));
      table_.publish(map_);
    }
    is_published = true;
  }
  EXPECT_EQ(published, kKeyframes);
}

}  // namespace
}  // namespace roslam
