// SPDX-License-Identifier: BSD-3-Clause
// Things are remembered from frame to frame: which is which, where each went, and those that labels miss.
#include <gtest/gtest.h>

#include "roslam/removal/object_memory.hpp"
#include "tests/removal_scene.hpp"

namespace roslam::scene {
namespace {

constexpr double kFrame = 1.0 / 30.0;  // seconds

class Memory : public testing::Test {
 protected:
  std::vector<int> ids() const {
    std::vector<int> result;
    for (const auto& object : memory_.objects()) result.push_back(object.id);
    return result;
  }

  static cv::Mat drawn(const MovableObject& object) {
    cv::Mat image = cv::Mat::zeros(240, 320, CV_8UC1);
    paint(object, image);
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
  const FlowCheck flow_{stage_.camera(), RemovalOptions{}, DepthOptions{}, MeasurementNoise{},
                        PoseOptimiserOptions{}};
  RemovalOptions options_;
  ObjectMemory memory_{options_};
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
    if (last) memory_.carry(*last, frame, flow_);
    // The labels come in another order each time.
    std::vector<MovableObject> labelled{on(view.shows(2)), on(view.shows(3))};
    if (i % 2 == 1) std::swap(labelled[0], labelled[1]);
    memory_.join(labelled, frame.timestamp);
    ASSERT_EQ(memory_.objects().size(), 2U);
    for (const auto& object : memory_.objects()) {
      EXPECT_EQ(object.id, overlap(object, on(view.shows(2))) > 0.9 ? 1 : 2);
      EXPECT_EQ(object.sightings, i + 1);
      EXPECT_EQ(object.misses, 0);
    }
    last = frame;
  }
  EXPECT_EQ(memory_.flickers(), 0U);
}

TEST_F(Memory, CarriesMasksWithTheThingsTheyBelongTo) {
  const Panel box{-0.4, -0.4, 0.2, 0.4, 2.0};
  const SE3 pose = turned(0.02, {0.02, 0.0, 0.05});
  const View before = stage_.show({kWall, box});
  const View after = stage_.show({kWall, box.shifted(0.06, 0.03)}, pose);
  memory_.join({on(before.shows(2))}, 0.0);
  memory_.carry(stage_.past(before, 0, 0.0, SE3(), before.shows(2)), stage_.past(after, 1, kFrame, pose),
                flow_);
  ASSERT_EQ(memory_.objects().size(), 1U);
  EXPECT_LT(agreement(before.shows(2), after.shows(2)), 0.92);
  EXPECT_GT(agreement(drawn(memory_.objects()[0]), after.shows(2)), 0.95);
}

TEST_F(Memory, CarriesWithTheCameraWhatHasTooFewPoints) {
  const Panel box{-0.4, -0.4, 0.2, 0.4, 2.0};
  const SE3 pose = looking_from(0.1, -0.05, 0.0);
  const View before = stage_.show({kWall, box});
  const View after = stage_.show({kWall, box}, pose);
  PastFrame from = stage_.past(before, 0, 0.0, SE3());
  from.points.clear();
  memory_.join({on(before.shows(2))}, 0.0);
  memory_.carry(from, stage_.past(after, 1, kFrame, pose), flow_);
  ASSERT_EQ(memory_.objects().size(), 1U);
  EXPECT_LT(agreement(before.shows(2), after.shows(2)), 0.8);
  EXPECT_GT(agreement(drawn(memory_.objects()[0]), after.shows(2)), 0.95);
}

TEST_F(Memory, ForgetsWhatLeavesThePicture) {
  const View view = stage_.show({kWall});
  PastFrame from = stage_.past(view, 0, 0.0, SE3());
  from.points.clear();
  memory_.join({boxed({290, 100, 30, 50}), boxed({100, 100, 40, 40})}, 0.0);
  memory_.carry(from, stage_.past(view, 1, kFrame, looking_from(-0.2, 0.0, 0.0)), flow_);  // 17 pixels
  ASSERT_EQ(memory_.objects().size(), 2U);
  EXPECT_EQ(memory_.objects()[0].box.br().x, 320);
  EXPECT_NEAR(memory_.objects()[0].box.width, 13, 1);
  memory_.carry(from, stage_.past(view, 2, 2 * kFrame, looking_from(-0.4, 0.0, 0.0)), flow_);
  EXPECT_EQ(ids(), std::vector<int>{2});
}

TEST_F(Memory, KeepsWhatLabelsMissForAWhile) {
  memory_.join({boxed({100, 100, 40, 80})}, 1.0);
  memory_.join({}, 1.0 + options_.keep_missed - 0.01);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].misses, 1);
  EXPECT_EQ(memory_.objects()[0].last_seen, 1.0);
  memory_.join({}, 1.0 + options_.keep_missed + 0.01);
  EXPECT_TRUE(memory_.objects().empty());
  memory_.join({boxed({100, 100, 40, 80})}, 2.0);
  EXPECT_EQ(ids(), std::vector<int>{2});
  EXPECT_EQ(memory_.flickers(), 0U);
}

TEST_F(Memory, ForgetsUncertainThingsAtOnce) {
  memory_.join({boxed({100, 100, 40, 80}, Movable::kPerson, 0.3F)}, 1.0);
  memory_.join({}, 1.0 + kFrame);
  EXPECT_EQ(ids(), std::vector<int>{1});
  memory_.join({}, 1.0 + 3 * kFrame);
  EXPECT_TRUE(memory_.objects().empty());
}

TEST_F(Memory, AThingThatComesBackIsTheSameAndWasAFlicker) {
  memory_.join({boxed({100, 100, 40, 80})}, 1.0);
  memory_.join({}, 1.1);
  memory_.join({boxed({102, 100, 40, 80})}, 1.2);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].misses, 0);
  EXPECT_EQ(memory_.objects()[0].sightings, 2);
  EXPECT_EQ(memory_.flickers(), 1U);
}

TEST_F(Memory, AThingOnceSureIsNotDoubtedAtOnce) {
  memory_.join({boxed({100, 100, 40, 80}, Movable::kPerson, 0.9F)}, 1.0);
  memory_.join({boxed({100, 100, 40, 80}, Movable::kPerson, 0.2F)}, 1.1);
  EXPECT_FLOAT_EQ(memory_.objects()[0].confidence, 0.2F);
  EXPECT_GT(memory_.objects()[0].sureness, 0.8F);
  for (int i = 0; i < 30; ++i) {
    memory_.join({boxed({100, 100, 40, 80}, Movable::kPerson, 0.2F)}, 1.2 + 0.1 * i);
  }
  EXPECT_LT(memory_.objects()[0].sureness, 0.5F);
  memory_.join({boxed({100, 100, 40, 80}, Movable::kPerson, 0.7F)}, 5.0);
  EXPECT_FLOAT_EQ(memory_.objects()[0].sureness, 0.7F);
}

TEST_F(Memory, TheBestMatchIsTheSameThing) {
  memory_.join({boxed({100, 100, 40, 80}), boxed({130, 100, 40, 80})}, 1.0);
  EXPECT_EQ(ids(), (std::vector<int>{1, 2}));
  memory_.join({boxed({125, 100, 40, 80}), boxed({200, 100, 40, 80})}, 1.1);
  EXPECT_EQ(ids(), (std::vector<int>{2, 3, 1}));  // the last is the one that was missed
}

TEST_F(Memory, AScrapWithinAThingIsNotTheThing) {
  memory_.join({boxed({100, 100, 40, 80})}, 1.0);
  memory_.join_unlabelled({boxed({138, 110, 10, 10}, Movable::kUnknown)}, 1.0);
  EXPECT_EQ(ids(), (std::vector<int>{2, 1}));
  // The person has gone over the scrap, all of which is in it by now.
  memory_.join({boxed({110, 100, 40, 80})}, 1.1);
  ASSERT_EQ(ids(), (std::vector<int>{1, 2}));
  EXPECT_EQ(memory_.objects()[0].kind, Movable::kPerson);
}

TEST_F(Memory, WhatGeometryFindsIsNumberedAndForgottenToo) {
  memory_.join_unlabelled({boxed({100, 100, 40, 80}, Movable::kUnknown)}, 1.0);
  EXPECT_FALSE(is_confirmed(memory_.objects()[0]));  // once may be noise
  const std::vector<MovableObject> found{boxed({105, 100, 40, 80}, Movable::kUnknown),
                                         boxed({200, 100, 40, 80}, Movable::kUnknown)};
  EXPECT_EQ(memory_.join_unlabelled(found, 1.1), (std::vector<int>{1, 2}));
  EXPECT_TRUE(is_confirmed(memory_.objects()[0]));
  EXPECT_FALSE(is_confirmed(memory_.objects()[1]));
  memory_.objects().pop_back();
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].sightings, 2);
  EXPECT_EQ(memory_.objects()[0].box.x, 105);
  memory_.join_unlabelled({}, 1.35);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].misses, 1);
  memory_.join_unlabelled({}, 1.45);
  EXPECT_TRUE(memory_.objects().empty());
}

TEST_F(Memory, WhatLabelsExplainNeedsNoOtherName) {
  memory_.join({boxed({100, 100, 40, 80})}, 1.0);
  const auto ids_found = memory_.join_unlabelled({boxed({110, 110, 20, 20}, Movable::kUnknown)}, 1.0);
  EXPECT_EQ(ids_found, std::vector<int>{0});
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].kind, Movable::kPerson);
}

TEST_F(Memory, ALabelNamesWhatGeometryFound) {
  memory_.join_unlabelled({boxed({100, 100, 40, 80}, Movable::kUnknown)}, 1.0);
  memory_.join({boxed({100, 100, 40, 80}, Movable::kCar)}, 1.1);
  ASSERT_EQ(ids(), std::vector<int>{1});
  EXPECT_EQ(memory_.objects()[0].kind, Movable::kCar);
  EXPECT_EQ(memory_.flickers(), 0U);
}

}  // namespace
}  // namespace roslam::scene
