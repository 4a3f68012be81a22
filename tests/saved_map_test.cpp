// SPDX-License-Identifier: BSD-3-Clause
// A map saved and loaded behaves like the one in memory.
#include <gtest/gtest.h>

#include "roslam/common/error.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/slam/slam.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {
namespace {

class SavedMapTest : public Street {
 protected:
  static std::unique_ptr<Slam> slam_with(bool localises_only = false) {
    Options options;
    options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
    options.keyframes.enabled = !localises_only;
    return std::make_unique<Slam>(
        *camera_preset("simulated"), options, Mode::kDeterministic, nullptr,
        std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  }

  static void feed(Slam& slam, std::size_t begin, std::size_t end) {
    for (const Frame& frame : *frames_) {
      if (frame.index < begin || frame.index >= end) continue;
      ASSERT_TRUE(slam.process(frame).is_used());
    }
    slam.finish();
  }

  static void expect_same(const Slam& a, const Slam& b) {
    const Trajectory in_a = a.trajectory();
    const Trajectory in_b = b.trajectory();
    ASSERT_EQ(in_a.size(), in_b.size());
    for (std::size_t i = 0; i < in_a.size(); ++i)
      EXPECT_EQ(in_a[i].T_world_camera.matrix(), in_b[i].T_world_camera.matrix()) << i;
    EXPECT_TRUE(encode_map(a.saved_map()) == encode_map(b.saved_map()));
  }

  ~SavedMapTest() override { fs::remove_all(file_); }
  const fs::path file_ = scratch_path(".roslam");
};

TEST_F(SavedMapTest, TrackingAndMappingGoOnBitByBitAsInTheMapThatWasNeverSaved) {
  const auto first = slam_with();
  feed(*first, 0, 30);
  save_map(file_, first->saved_map());
  for (const bool localises_only : {false, true}) {
    const auto kept = slam_with(localises_only);
    kept->load_map(first->saved_map());
    feed(*kept, 30, kEnd);
    const auto loaded = slam_with(localises_only);
    loaded->load_map(load_map(file_));
    feed(*loaded, 30, kEnd);
    EXPECT_EQ(kept->trajectory().size(), kBeforeGap - 30 + kEnd - kGapEnd);
    expect_same(*kept, *loaded);
    for (const BagOfWords& words : kept->saved_map().words) EXPECT_FALSE(words.empty());
    EXPECT_TRUE(kept->found_in_loaded_map());
    if (!localises_only) continue;
    EXPECT_EQ(kept->map().keyframe_count(), first->map().keyframe_count());
  }
}

TEST_F(SavedMapTest, WithoutAMapThereIsNothingToLocaliseIn) {
  const auto slam = slam_with(true);
  EXPECT_EQ(slam->process(frames_->front()).rejected, RejectReason::kNoMapToLocaliseIn);
}

TEST_F(SavedMapTest, AMapOfAnotherCameraIsRefused) {
  const auto first = slam_with();
  feed(*first, 0, 5);
  SavedMap saved = first->saved_map();
  saved.camera.cx += 1.0;
  EXPECT_THROW(slam_with()->load_map(std::move(saved)), InputError);
}

}  // namespace
}  // namespace roslam::street
