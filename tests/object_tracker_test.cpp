// SPDX-License-Identifier: BSD-3-Clause
// Objects are tracked from frame to frame: identity, motion, and objects that labels miss.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/object_tracker.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr double kFrame = 1.0 / 30.0;  // seconds

class Memory : public testing::Test {
 protected:
  std::vector<int> ids() const {
    std::vector<int> result;
    for (const auto& object : object_tracker_.objects()) result.push_back(object.id);
    return result;
  }

  // Tracks the corners of the last frame to the current one, and the objects with them.
  void carry(const PastFrame& last, PastFrame now) {
    flow_.track(last, now);
    object_tracker_.carry(last, now, flow_);
  }

  static cv::Mat drawn(const MovableObject& object) {
    cv::Mat image = cv::Mat::zeros(240, 320, CV_8UC1);
    draw_object(object, image);
    return image;
  }

  static double agreement(const cv::Mat& a, const cv::Mat& b) {
    return static_cast<double>(cv::countNonZero(a & b)) / cv::countNonZero(a | b);
  }

  static MovableObject on(const cv::Mat& area, Movable kind = Movable::kPerson) {
    MovableObject object = boxed({0, 0, 1, 1}, kind);
    take_mask(object, area);
    return object;
  }

  const Stage stage_;
  const FlowConsistency flow_{stage_.camera(), DynamicObjectOptions{}, DepthOptions{}, MeasurementNoise{},
                              PoseOptimiserOptions{}};
  DynamicObjectOptions options_;
  ObjectTracker object_tracker_{options_};
};

TEST_F(Memory, ThingsKeepTheirNumbersWhileTheyMove) {
  const Panel left{-0.7, -0.4, -0.2, 0.4, 2.0};
  const Panel right{0.2, -0.4, 0.7, 0.4, 2.0};
  std::optional<PastFrame> last;
  for (int i = 0; i < 8; ++i) {
    // They go apart and the camera turns after one of them: 5 and 2 pixels a frame.
    const SE3 pose = turned(0.01 * i);
    const std::vector<Panel> panels{kWall, left.shifted(-0.02 * i), right.shifted(0.02 * i)};
    const View view = stage_.show(panels, pose);
    const PastFrame frame = stage_.past(view, static_cast<std::size_t>(i), kFrame * i, pose, view.panel > 1);
    if (last) carry(*last, frame);
    // The labels come in another order each time.
    std::vector<MovableObject> labelled{on(view.shows(2)), on(view.shows(3))};
    if (i % 2 == 1) std::swap(labelled[0], labelled[1]);
    object_tracker_.update_labelled(labelled, frame.timestamp);
    ASSERT_EQ(object_tracker_.objects().size(), 2U);
    for (const auto& object : object_tracker_.objects()) {
      EXPECT_EQ(object.id, overlap(object, on(view.shows(2))) > 0.9 ? 1 : 2);
      EXPECT_EQ(object.times_seen, i + 1);
      EXPECT_EQ(object.misses, 0);
    }
    last = frame;
  }
  EXPECT_EQ(object_tracker_.flickers(), 0U);
}

TEST_F(Memory, CarriesMasksWithTheThingsTheyBelongTo) {
  const Panel box{-0.4, -0.4, 0.2, 0.4, 2.0};
  const SE3 pose = turned(0.02, {0.02, 0.0, 0.05});
  const View before = stage_.show({kWall, box});
  const View after = stage_.show({kWall, box.shifted(0.06, 0.03)}, pose);
  object_tracker_.update_labelled({on(before.shows(2))}, 0.0);
  carry(stage_.past(before, 0, 0.0, SE3(), before.shows(2)), stage_.past(after, 1, kFrame, pose));
  ASSERT_EQ(object_tracker_.objects().size(), 1U);
  EXPECT_LT(agreement(before.shows(2), after.shows(2)), 0.92);
  EXPECT_GT(agreement(drawn(object_tracker_.objects()[0]), after.shows(2)), 0.95);
}

TEST_F(Memory, CarriesWithTheCameraWhatHasTooFewPoints) {
  const Panel box{-0.4, -0.4, 0.2, 0.4, 2.0};
  const SE3 pose = looking_from(0.1, -0.05, 0.0);
  const View before = stage_.show({kWall, box});
  const View after = stage_.show({kWall, box}, pose);
  PastFrame from = stage_.past(before, 0, 0.0, SE3());
  from.corners.clear();
  object_tracker_.update_labelled({on(before.shows(2))}, 0.0);
  carry(from, stage_.past(after, 1, kFrame, pose));
  ASSERT_EQ(object_tracker_.objects().size(), 1U);
  EXPECT_LT(agreement(before.shows(2), after.shows(2)), 0.8);
  EXPECT_GT(agreement(drawn(object_tracker_.objects()[0]), after.shows(2)), 0.95);
}

TEST_F(Memory, ForgetsWhatLeavesTheImage) {
  const View view = stage_.show({kWall});
  PastFrame from = stage_.past(view, 0, 0.0, SE3());
  from.corners.clear();
  object_tracker_.update_labelled({boxed({290, 100, 30, 50}), boxed({100, 100, 40, 40})}, 0.0);
  carry(from, stage_.past(view, 1, kFrame, looking_from(-0.2, 0.0, 0.0)));  // 17 pixels
  ASSERT_EQ(object_tracker_.objects().size(), 2U);
  EXPECT_EQ(object_tracker_.objects()[0].box.br().x, 320);
  EXPECT_NEAR(object_tracker_.objects()[0].box.width, 13, 1);
  carry(from, stage_.past(view, 2, 2 * kFrame, looking_from(-0.4, 0.0, 0.0)));
  EXPECT_EQ(ids(), std::vector<int>{2});
}

TEST_F(Memory, KeepsWhatLabelsMissForAWhile) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80})}, 1.0);
  object_tracker_.update_labelled({}, 1.0 + options_.keep_missed - 0.01);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].misses, 1);
  EXPECT_EQ(object_tracker_.objects()[0].last_seen, 1.0);
  object_tracker_.update_labelled({}, 1.0 + options_.keep_missed + 0.01);
  EXPECT_TRUE(object_tracker_.objects().empty());
  object_tracker_.update_labelled({boxed({100, 100, 40, 80})}, 2.0);
  EXPECT_EQ(ids(), std::vector<int>{2});
  EXPECT_EQ(object_tracker_.flickers(), 0U);
}

TEST_F(Memory, ForgetsUncertainThingsAtOnce) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kPerson, 0.3F)}, 1.0);
  object_tracker_.update_labelled({}, 1.0 + kFrame);
  EXPECT_EQ(ids(), std::vector<int>{1});
  object_tracker_.update_labelled({}, 1.0 + 3 * kFrame);
  EXPECT_TRUE(object_tracker_.objects().empty());
}

TEST_F(Memory, AThingThatComesBackIsTheSameAndWasAFlicker) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80})}, 1.0);
  object_tracker_.update_labelled({}, 1.1);
  object_tracker_.update_labelled({boxed({102, 100, 40, 80})}, 1.2);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].misses, 0);
  EXPECT_EQ(object_tracker_.objects()[0].times_seen, 2);
  EXPECT_EQ(object_tracker_.flickers(), 1U);
}

TEST_F(Memory, AThingOnceSureIsNotDoubtedAtOnce) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kPerson, 0.9F)}, 1.0);
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kPerson, 0.2F)}, 1.1);
  EXPECT_FLOAT_EQ(object_tracker_.objects()[0].confidence, 0.2F);
  EXPECT_GT(object_tracker_.objects()[0].decayed_confidence, 0.8F);
  for (int i = 0; i < 30; ++i) {
    object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kPerson, 0.2F)}, 1.2 + 0.1 * i);
  }
  EXPECT_LT(object_tracker_.objects()[0].decayed_confidence, 0.5F);
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kPerson, 0.7F)}, 5.0);
  EXPECT_FLOAT_EQ(object_tracker_.objects()[0].decayed_confidence, 0.7F);
}

TEST_F(Memory, TheBestMatchIsTheSameThing) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}), boxed({130, 100, 40, 80})}, 1.0);
  EXPECT_EQ(ids(), (std::vector<int>{1, 2}));
  object_tracker_.update_labelled({boxed({125, 100, 40, 80}), boxed({200, 100, 40, 80})}, 1.1);
  EXPECT_EQ(ids(), (std::vector<int>{2, 3, 1}));  // the last is the one that was missed
}

TEST_F(Memory, AScrapWithinAThingIsNotTheThing) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80})}, 1.0);
  object_tracker_.update_unlabelled({boxed({138, 110, 10, 10}, Movable::kUnknown)}, 1.0);
  EXPECT_EQ(ids(), (std::vector<int>{2, 1}));
  // The fragment now lies entirely within the person's box.
  object_tracker_.update_labelled({boxed({110, 100, 40, 80})}, 1.1);
  ASSERT_EQ(ids(), (std::vector<int>{1, 2}));
  EXPECT_EQ(object_tracker_.objects()[0].kind, Movable::kPerson);
}

TEST_F(Memory, WhatGeometryFindsIsNumberedAndForgottenToo) {
  object_tracker_.update_unlabelled({boxed({100, 100, 40, 80}, Movable::kUnknown)}, 1.0);
  EXPECT_FALSE(is_seen_repeatedly(object_tracker_.objects()[0]));  // once may be noise
  const std::vector<MovableObject> found{boxed({105, 100, 40, 80}, Movable::kUnknown),
                                         boxed({200, 100, 40, 80}, Movable::kUnknown)};
  EXPECT_EQ(object_tracker_.update_unlabelled(found, 1.1), (std::vector<int>{1, 2}));
  EXPECT_TRUE(is_seen_repeatedly(object_tracker_.objects()[0]));
  EXPECT_FALSE(is_seen_repeatedly(object_tracker_.objects()[1]));
  object_tracker_.objects().pop_back();
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].times_seen, 2);
  EXPECT_EQ(object_tracker_.objects()[0].box.x, 105);
  object_tracker_.update_unlabelled({}, 1.35);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].misses, 1);
  object_tracker_.update_unlabelled({}, 1.45);
  EXPECT_TRUE(object_tracker_.objects().empty());
}

TEST_F(Memory, WhatLabelsExplainNeedsNoOtherName) {
  object_tracker_.update_labelled({boxed({100, 100, 40, 80})}, 1.0);
  const auto ids_found =
      object_tracker_.update_unlabelled({boxed({110, 110, 20, 20}, Movable::kUnknown)}, 1.0);
  EXPECT_EQ(ids_found, std::vector<int>{0});
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].kind, Movable::kPerson);
}

TEST_F(Memory, ALabelNamesWhatGeometryFound) {
  object_tracker_.update_unlabelled({boxed({100, 100, 40, 80}, Movable::kUnknown)}, 1.0);
  object_tracker_.update_labelled({boxed({100, 100, 40, 80}, Movable::kCar)}, 1.1);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(object_tracker_.objects()[0].kind, Movable::kCar);
  EXPECT_EQ(object_tracker_.flickers(), 0U);
}

}  // namespace
}  // namespace roslam::scene
