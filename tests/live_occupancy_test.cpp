// SPDX-License-Identifier: BSD-3-Clause
// Occupancy that is kept up while a dense map grows, against one that is made of the whole map.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "roslam/occupancy/live_occupancy.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/dense_scene.hpp"

namespace roslam {
namespace {

using namespace dense_scene;
using Cells = std::map<std::tuple<int, int, int>, OccupancyState>;  // known ones

void apply(const OccupancyGrid::Block& block, Cells& cells) {
  for (int i = 0; i < 512; ++i) {
    const Eigen::Vector3i at = block.first_cell + Eigen::Vector3i(i & 7, i >> 3 & 7, i >> 6);
    const OccupancyState state = block.cells[static_cast<std::size_t>(i)];
    const auto key = std::tuple(at.x(), at.y(), at.z());
    if (state == OccupancyState::kUnknown) {
      cells.erase(key);
    } else {
      cells[key] = state;
    }
  }
}

Cells cells_of(const OccupancyGrid& grid) {
  Cells cells;
  grid.visit([&](const auto& block) { apply(block, cells); });
  return cells;
}

class LiveOccupancyOfARoom : public testing::Test {
 protected:
  static constexpr SubmapId kSubmap{0};
  const Camera camera_ = scene::small_camera();
  const std::vector<Slab> room_{kWall, kFloor};
  const std::vector<SE3> poses_ = walk(8);
  DenseMapper mapper_{options(), {}};
  LiveOccupancy live_{options()};

  void insert(std::uint32_t i, SubmapId submap = kSubmap) {
    const auto pose = poses_[i];
    mapper_.insert(KeyframeId{i}, view(show(room_, pose, camera_), camera_), {submap, pose});
  }

  std::shared_ptr<const OccupancyGrid> update(SubmapId submap = kSubmap) {
    live_.update(mapper_, mapper_.take_changes());
    return live_.grid(submap, 1.0);
  }

  // To be called after update(), as it takes the changes as well.
  Cells from_scratch(SubmapId submap = kSubmap) {
    mapper_.restart_changes();
    LiveOccupancy other(options());
    other.update(mapper_, mapper_.take_changes());
    const auto grid = other.grid(submap, 1.0);
    return grid ? cells_of(*grid) : Cells{};
  }
};

TEST_F(LiveOccupancyOfARoom, IsFreeBeforeTheWallOccupiedAtItAndUnknownBehind) {
  EXPECT_EQ(update(), nullptr);
  for (std::uint32_t i = 0; i < 4; ++i) insert(i);
  const auto grid = update();
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->keyframes(), 4U);
  EXPECT_EQ(grid->timestamp(), 1.0);
  EXPECT_EQ(grid->submap(), kSubmap);
  for (double z = 0.3; z < 3.8; z += 0.1) EXPECT_EQ(grid->at({0.1, 0.0, z}), OccupancyState::kFree) << z;
  EXPECT_EQ(grid->at({0.1, 0.0, 3.99}), OccupancyState::kOccupied);
  EXPECT_EQ(grid->at({0.1, 0.0, 4.5}), OccupancyState::kUnknown);
  EXPECT_EQ(grid->at({std::nan(""), 0.0, 1.0}), OccupancyState::kUnknown);
  EXPECT_EQ(grid->at({1e30, 0.0, 1.0}), OccupancyState::kUnknown);
}

TEST_F(LiveOccupancyOfARoom, EqualsThatOfTheWholeMapWhateverMoves) {
  for (std::uint32_t i = 0; i < 6; ++i) {
    insert(i);
    const Cells now = cells_of(*update());
    EXPECT_EQ(now, from_scratch());
  }
  std::map<KeyframeId, KeyframePose> corrected;
  for (std::uint32_t i = 0; i < 6; ++i) corrected[KeyframeId{i}] = {kSubmap, poses_[i]};
  const SE3 shift(Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.2});
  corrected[KeyframeId{2}].T_world_camera = shift * poses_[2];
  corrected[KeyframeId{4}].T_world_camera = shift * poses_[4];
  EXPECT_EQ(mapper_.follow(corrected), 2U);
  const Cells moved = cells_of(*update());
  EXPECT_EQ(moved, from_scratch());
  corrected[KeyframeId{4}].T_world_camera = poses_[4];
  corrected[KeyframeId{1}] = {};  // withdrawn
  mapper_.follow(corrected);
  insert(6);
  corrected[KeyframeId{0}].submap = SubmapId{1};
  mapper_.follow(corrected);
  const auto grid = update();
  EXPECT_EQ(cells_of(*grid), from_scratch());
  EXPECT_EQ(grid->keyframes(), 5U);
  EXPECT_EQ(cells_of(*live_.grid(SubmapId{1}, 2.0)), from_scratch(SubmapId{1}));
}

TEST_F(LiveOccupancyOfARoom, GivesWhatChanged) {
  insert(0);
  auto before = update();
  Cells copy = cells_of(*before);
  const Cells first = copy;
  std::size_t changed = 0;
  for (std::uint32_t i = 1; i < 8; ++i) {
    insert(i);
    const auto now = update();
    now->visit_changed(*before, [&](const auto& block) {
      apply(block, copy);
      ++changed;
    });
    EXPECT_EQ(copy, cells_of(*now)) << i;
    before = now;
  }
  EXPECT_GT(changed, 0U);
  std::map<KeyframeId, KeyframePose> gone;
  for (std::uint32_t i = 1; i < 8; ++i) gone[KeyframeId{i}] = {};
  mapper_.follow(gone);
  const auto last = update();
  last->visit_changed(*before, [&](const auto& block) { apply(block, copy); });
  EXPECT_EQ(copy, first) << "all but the first keyframe were withdrawn";
}

TEST_F(LiveOccupancyOfARoom, BeginsAnewWhereVoxelsBecomeLarger) {
  DenseOptions small = options();
  small.max_memory = 16;
  small.voxel_size = 0.01;
  DenseMapper mapper(small, {});
  LiveOccupancy live(small);
  for (std::uint32_t i = 0; i < 8; ++i) {
    mapper.insert(KeyframeId{i}, view(show(room_, poses_[i], camera_), camera_), {kSubmap, poses_[i]});
    live.update(mapper, mapper.take_changes());
  }
  ASSERT_GT(mapper.times_coarsened(), 0);
  const auto grid = live.grid(kSubmap, 0.0);
  EXPECT_EQ(grid->resolution(), usual_resolution(mapper.voxel_size()));
  mapper.restart_changes();
  LiveOccupancy whole(small);
  whole.update(mapper, mapper.take_changes());
  EXPECT_EQ(cells_of(*grid), cells_of(*whole.grid(kSubmap, 0.0)));
}

TEST(LiveOccupancyInFlight, IsThereForAPlanner) {
  simulation::SimulatorOptions simulated;
  simulated.traffic = simulation::TrafficLevel::kNone;
  simulated.frames = 45;
  simulation::SimulatedSource source(simulated);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(source.camera(), options);
  EXPECT_EQ(slam.occupancy(), nullptr) << "no dense map is made";
  slam.enable_dense_mapping();
  EXPECT_EQ(slam.occupancy(), nullptr) << "from now on";
  std::shared_ptr<const OccupancyGrid> first;
  while (const auto frame = source.next()) {
    slam.process(*frame);
    const auto grid = slam.occupancy();
    ASSERT_TRUE(grid);
    EXPECT_LE(frame->timestamp - grid->timestamp(), 1.0) << "a keyframe a second";
    if (!first) first = grid;
  }
  slam.finish();
  const auto last = slam.occupancy();
  EXPECT_EQ(first->keyframes(), 1U) << "does not change any more";
  EXPECT_GT(last->keyframes(), 3U);
  for (const StampedPose& pose : slam.trajectory())
    EXPECT_NE(last->at(pose.T_world_camera.translation()), OccupancyState::kOccupied) << pose.timestamp;
  int free = 0, occupied = 0;
  for (const auto& [cell, state] : cells_of(*last)) ++(state == OccupancyState::kFree ? free : occupied);
  EXPECT_GT(free, 10000);
  EXPECT_GT(occupied, 3000);
}

}  // namespace
}  // namespace roslam
