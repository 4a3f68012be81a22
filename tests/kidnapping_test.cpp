// SPDX-License-Identifier: BSD-3-Clause
// Recorded flights with a gap of two seconds: the camera relocalises at once when it returns.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <ostream>

#include "roslam/datasets/tum_source.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam {
namespace {

constexpr std::size_t kMissing = 60;  // frames

struct Kidnapping {
  const char* sequence;
  const char* camera;
  std::size_t gap;  // first frame that is missing
  bool is_cut;      // else black

  friend std::ostream& operator<<(std::ostream& out, const Kidnapping& kidnapping) {
    return out << kidnapping.sequence << kidnapping.gap << (kidnapping.is_cut ? "cut" : "black");
  }
};

class Kidnapped : public testing::TestWithParam<Kidnapping> {
 protected:
  void SetUp() override {
    const std::filesystem::path folder =
        std::filesystem::path(ROSLAM_TEST_DATA) / "slam" / GetParam().sequence;
    if (!std::filesystem::exists(folder / "rgb.txt")) GTEST_SKIP() << folder << " is not there";
    source_ = std::make_unique<TumSource>(folder, *camera_preset(GetParam().camera));
    truth_ = read_trajectory(folder / "groundtruth.txt").trajectory;
    Options options;
    options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
    slam_ = std::make_unique<Slam>(
        source_->camera(), options, Mode::kDeterministic, nullptr,
        std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  }

  SE3 T_world_camera(double time) const {
    const auto nearest = std::min_element(truth_.begin(), truth_.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.timestamp - time) < std::abs(b.timestamp - time);
    });
    return nearest->T_world_camera;
  }

  std::unique_ptr<TumSource> source_;
  std::unique_ptr<Slam> slam_;
  Trajectory truth_;
};

// Error of the relative translation, metres.
double error(const SE3& T_w_a, const SE3& T_w_b, const SE3& true_T_w_a, const SE3& true_T_w_b) {
  return ((T_w_a.inverse() * T_w_b).translation() - (true_T_w_a.inverse() * true_T_w_b).translation()).norm();
}

TEST_P(Kidnapped, FindsItselfWithinTenFramesAndStaysThere) {
  const std::size_t back = GetParam().gap + kMissing;
  std::optional<SE3> before, last;
  SE3 true_before, true_last;
  std::size_t found_at = 0;
  for (std::size_t i = 0; i < back + 30; ++i) {
    auto frame = source_->next();
    ASSERT_TRUE(frame);
    const bool is_missing = i >= GetParam().gap && i < back;
    if (is_missing && GetParam().is_cut) continue;
    if (is_missing) {
      frame->colour = cv::Mat::zeros(frame->colour.size(), CV_8UC3);
      frame->depth = cv::Mat::zeros(frame->depth.size(), CV_32FC1);
    }
    const auto result = slam_->process(*frame);
    ASSERT_TRUE(result.is_used());
    const SE3 truth = T_world_camera(frame->timestamp);
    if (i < GetParam().gap) {
      ASSERT_TRUE(result.T_world_camera) << i;
      before = result.T_world_camera;
      true_before = truth;
    }
    if (i < back || !result.T_world_camera) continue;
    EXPECT_EQ(result.submap, SubmapId{0}) << "begins a new world";
    if (!last) {
      found_at = i;
      EXPECT_LT(error(*before, *result.T_world_camera, true_before, truth), 0.15);
    } else {
      EXPECT_LT(error(*last, *result.T_world_camera, true_last, truth), 0.05) << "jumps at " << i;
    }
    last = result.T_world_camera;
    true_last = truth;
  }
  ASSERT_TRUE(last) << "stays lost";
  EXPECT_LE(found_at - back, 10U);
}

std::vector<Kidnapping> kidnappings() {
  std::vector<Kidnapping> result;
  for (const bool is_cut : {true, false}) {
    for (const std::size_t gap : {70, 130, 190}) {
      result.push_back({"kitchen", "7scenes", gap, is_cut});
      result.push_back({"fr1_rpy", "tum-fr1", gap, is_cut});
    }
  }
  return result;
}

INSTANTIATE_TEST_SUITE_P(Recorded, Kidnapped, testing::ValuesIn(kidnappings()), [](const auto& tested) {
  std::ostringstream name;
  name << tested.param;
  return name.str();
});

}  // namespace
}  // namespace roslam
