// SPDX-License-Identifier: BSD-3-Clause
// Objects from labels, and the geometric evidence for each.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/movable_object.hpp"
#include "roslam/dynamic_objects/object_evidence.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr int kPersonLabel = 11;
constexpr int kRiderLabel = 12;
constexpr int kCarLabel = 13;

class Objects : public testing::Test {
 protected:
  std::vector<MovableObject> find(double min_share = 0.0005) const {
    return find_objects(segmentation_, grid_.depth_cells(depth_, {}), grid_, min_share);
  }

  void label(const cv::Rect& box, int value, float depth) {
    segmentation_.labels(box).setTo(value);
    depth_(box).setTo(depth);
  }

  const CellGrid grid_{small_camera()};
  cv::Mat depth_{240, 320, CV_32FC1, cv::Scalar(6.0)};
  Segmentation segmentation_{cv::Mat::zeros(240, 320, CV_8UC1), {}, {}, 0.0};
};

TEST_F(Objects, NoneWithoutLabels) { EXPECT_TRUE(find().empty()); }

TEST_F(Objects, AreFoundWithClassPlaceAndDepth) {
  label({40, 50, 30, 80}, kPersonLabel, 2.5F);
  label({200, 100, 80, 40}, kCarLabel, 5.0F);
  segmentation_.confidence[kPersonLabel] = 0.8F;
  segmentation_.confidence[kCarLabel] = 0.6F;
  const auto objects = find();
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0].kind, Movable::kPerson);
  EXPECT_EQ(objects[0].box, cv::Rect(40, 50, 30, 80));
  EXPECT_EQ(cv::countNonZero(objects[0].mask), 30 * 80);
  EXPECT_EQ(objects[0].median_depth, 2.5F);
  EXPECT_FLOAT_EQ(objects[0].confidence, 0.8F);
  EXPECT_FLOAT_EQ(objects[0].decayed_confidence, 0.8F);
  EXPECT_EQ(objects[1].kind, Movable::kCar);
  EXPECT_EQ(objects[1].box, cv::Rect(200, 100, 80, 40));
  EXPECT_EQ(objects[1].median_depth, 5.0F);
  EXPECT_FLOAT_EQ(objects[1].confidence, 0.6F);
}

TEST(TouchingObjects, AtDifferentDepthAreTwo) {
  const CellGrid grid(*camera_preset("simulated"));
  Segmentation segmentation{cv::Mat::zeros(480, 640, CV_8UC1), {}, {}, 0.0};
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(6.0));
  const cv::Rect left(120, 100, 80, 200);
  const cv::Rect right(200, 100, 80, 200);
  segmentation.labels(left | right).setTo(kPersonLabel);
  depth(left).setTo(2.0F);
  depth(right).setTo(3.0F);
  const auto objects = find_objects(segmentation, grid.depth_cells(depth, {}), grid, 0.0005);
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0].median_depth, 2.0F);
  EXPECT_EQ(objects[1].median_depth, 3.0F);
  EXPECT_NEAR(objects[0].box.br().x, 200, grid.side());
  EXPECT_NEAR(objects[1].box.x, 200, grid.side());
  // The same area at one depth.
  depth(right).setTo(2.1F);
  EXPECT_EQ(find_objects(segmentation, grid.depth_cells(depth, {}), grid, 0.0005).size(), 1U);
}

TEST_F(Objects, HolesInDepthDivideNothing) {
  label({60, 40, 60, 120}, kPersonLabel, 2.0F);
  depth_(cv::Rect(60, 90, 60, 10)).setTo(0.0F);
  depth_(cv::Rect(80, 40, 6, 60)).setTo(0.0F);
  ASSERT_EQ(find().size(), 1U);
  EXPECT_EQ(find()[0].box, cv::Rect(60, 40, 60, 120));
  EXPECT_EQ(find()[0].median_depth, 2.0F);
  depth_.setTo(0.0F);
  ASSERT_EQ(find().size(), 1U);
  EXPECT_EQ(find()[0].median_depth, 0.0F);
}

TEST_F(Objects, ARiderIsPartOfThePersonAndACarIsNot) {
  label({60, 40, 40, 40}, kPersonLabel, 2.0F);
  label({60, 80, 40, 40}, kRiderLabel, 2.0F);
  label({60, 120, 40, 40}, kCarLabel, 2.0F);
  const auto objects = find();
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0].box, cv::Rect(60, 40, 40, 80));
  EXPECT_EQ(objects[1].kind, Movable::kCar);
}

TEST_F(Objects, SpecksAreLeftOut) {
  label({60, 40, 8, 8}, kPersonLabel, 2.0F);  // 16 cells of 19200
  EXPECT_EQ(find(17.0 / 19200.0).size(), 0U);
  EXPECT_EQ(find(16.0 / 19200.0).size(), 1U);
}

TEST_F(Objects, ConfidenceIsThatOfTheirPlace) {
  label({0, 0, 80, 80}, kPersonLabel, 2.0F);
  label({200, 120, 80, 80}, kPersonLabel, 2.0F);
  segmentation_.confidence[kPersonLabel] = 0.7F;
  segmentation_.probability = cv::Mat(24, 32, CV_32FC1, cv::Scalar(0.9));
  segmentation_.probability(cv::Rect(0, 0, 8, 8)).setTo(0.4F);
  const auto objects = find();
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_NEAR(objects[0].confidence, 0.4F, 1e-5F);
  EXPECT_NEAR(objects[1].confidence, 0.9F, 1e-5F);
}

TEST_F(Objects, OverlapIsAShareOfTheSmaller) {
  const auto large = boxed({100, 100, 40, 40});
  EXPECT_DOUBLE_EQ(overlap(large, large), 1.0);
  EXPECT_DOUBLE_EQ(overlap(large, boxed({110, 110, 10, 10})), 1.0);
  EXPECT_DOUBLE_EQ(overlap(boxed({135, 100, 10, 40}), large), 0.5);
  EXPECT_DOUBLE_EQ(overlap(large, boxed({140, 100, 10, 10})), 0.0);
  auto hollow = boxed({100, 100, 40, 40});
  hollow.mask.colRange(10, 40).setTo(0);
  EXPECT_DOUBLE_EQ(overlap(hollow, boxed({105, 100, 20, 40})), 0.5);
  EXPECT_DOUBLE_EQ(overlap(hollow, boxed({120, 100, 20, 40})), 0.0);
}

TEST_F(Objects, TakeTheirMaskFromAImageAndPaintItBack) {
  cv::Mat image = cv::Mat::zeros(240, 320, CV_8UC1);
  MovableObject object;
  EXPECT_FALSE(take_mask(object, image));
  cv::circle(image, {70, 90}, 20, 255, cv::FILLED);
  ASSERT_TRUE(take_mask(object, image));
  EXPECT_EQ(object.box, cv::Rect(50, 70, 41, 41));
  cv::Mat painted = cv::Mat::zeros(240, 320, CV_8UC1);
  draw_object(object, painted);
  EXPECT_EQ(cv::norm(painted, image, cv::NORM_INF), 0.0);
  image.setTo(0);  // what was taken is the object's own
  EXPECT_FALSE(take_mask(object, image));
  EXPECT_EQ(object.box, cv::Rect(50, 70, 41, 41));
  EXPECT_EQ(cv::countNonZero(object.mask), cv::countNonZero(painted));
}

TEST_F(Objects, MedianDepthIsOfWhatIsKnownUnderTheMask) {
  cv::Mat cells(grid_.size(), CV_32FC1, cv::Scalar(9.0));
  auto object = boxed({100, 100, 10, 2});  // five cells
  for (int i = 0; i < 5; ++i) cells.at<float>(50, 50 + i) = 1.0F + static_cast<float>(i * i);
  EXPECT_EQ(median_depth(object, cells, grid_), 5.0F);
  cells.at<float>(50, 50) = cells.at<float>(50, 51) = 0.0F;
  EXPECT_EQ(median_depth(object, cells, grid_), 10.0F);
  object.mask.colRange(8, 10).setTo(0);
  cells.at<float>(50, 50) = 1.0F;
  cells.at<float>(50, 51) = 2.0F;
  EXPECT_EQ(median_depth(object, cells, grid_), 5.0F);
  cells.setTo(0.0F);
  EXPECT_EQ(median_depth(object, cells, grid_), 0.0F);
}

// An object of a hundred cells that has not moved for long.
ObjectEvidence at_rest() {
  ObjectEvidence evidence;
  evidence.cells = evidence.known = evidence.at_rest_briefly = evidence.at_rest_long = 100;
  evidence.flow_at_rest = 20;
  return evidence;
}

struct Doubt {
  const char* why;
  void (*spoil)(ObjectEvidence&);
};

TEST(ObjectEvidence, RestsOnlyIfAllSaysSo) {
  const DynamicObjectOptions options;
  EXPECT_TRUE(has_rested(at_rest(), options));
  EXPECT_FALSE(has_rested({}, options));
  const std::vector<Doubt> doubts{{"not long enough", [](auto& e) { e.at_rest_long = 85; }},
                                  {"a part moves", [](auto& e) { e.moving = 8; }},
                                  {"hardly known", [](auto& e) { e.known = e.at_rest_long = 35; }},
                                  {"points move", [](auto& e) { e.flow_moving = 3; }}};
  for (const auto& [why, spoil] : doubts) {
    ObjectEvidence evidence = at_rest();
    spoil(evidence);
    EXPECT_FALSE(has_rested(evidence, options)) << why;
  }
  ObjectEvidence evidence = at_rest();
  evidence.flow_moving = 3;
  evidence.is_flow_fine = false;  // points that seem to move in a blurred image prove nothing
  EXPECT_TRUE(has_rested(evidence, options));
  DynamicObjectOptions no_flow;
  no_flow.flow = false;
  evidence.is_flow_fine = true;
  EXPECT_TRUE(has_rested(evidence, no_flow));
}

TEST(ObjectEvidence, SeemsAtRestOnlyIfAllThatIsAskedSaysSo) {
  const DynamicObjectOptions options;
  ObjectEvidence brief = at_rest();
  brief.at_rest_long = 0;
  EXPECT_TRUE(seems_at_rest(brief, options));
  EXPECT_FALSE(seems_at_rest({}, options));
  const std::vector<Doubt> by_depth{{"new here", [](auto& e) { e.at_rest_briefly = 75; }},
                                    {"a part moves", [](auto& e) { e.moving = 8; }},
                                    {"hardly known", [](auto& e) { e.known = e.at_rest_briefly = 35; }}};
  const std::vector<Doubt> by_flow{{"few points", [](auto& e) { e.flow_at_rest = 4; }},
                                   {"points move", [](auto& e) { e.flow_moving = 3; }},
                                   {"blurred", [](auto& e) { e.is_flow_fine = false; }}};
  DynamicObjectOptions only_flow;
  only_flow.depth_consistency = false;
  DynamicObjectOptions only_depth;
  only_depth.flow = false;
  for (const auto* doubts : {&by_depth, &by_flow}) {
    for (const auto& [why, spoil] : *doubts) {
      ObjectEvidence evidence = brief;
      spoil(evidence);
      EXPECT_FALSE(seems_at_rest(evidence, options)) << why;
      EXPECT_EQ(seems_at_rest(evidence, only_flow), doubts == &by_depth) << why;
      EXPECT_EQ(seems_at_rest(evidence, only_depth), doubts == &by_flow) << why;
    }
  }
}

TEST(ObjectEvidence, PointsAtRestContradictMotion) {
  const auto contradicts = [](int flow_at_rest, int flow_moving) {
    ObjectEvidence evidence;
    evidence.flow_at_rest = flow_at_rest;
    evidence.flow_moving = flow_moving;
    return contradicts_motion(evidence);
  };
  EXPECT_TRUE(contradicts(4, 0));
  EXPECT_TRUE(contradicts(8, 2));
  EXPECT_FALSE(contradicts(3, 0));  // too few
  EXPECT_FALSE(contradicts(8, 3));
  EXPECT_FALSE(contradicts(0, 8));
}

TEST(ObjectEvidence, IsCountedForEachThing) {
  const CellGrid grid(small_camera());
  cv::Mat owners = cv::Mat::zeros(grid.size(), CV_32SC1);
  owners(cv::Rect(10, 10, 10, 10)).setTo(1);
  owners(cv::Rect(40, 10, 10, 10)).setTo(2);
  DepthEvidence space{cv::Mat::zeros(grid.size(), CV_8UC1), cv::Mat::zeros(grid.size(), CV_32FC1)};
  space.state(cv::Rect(10, 10, 10, 4)).setTo(static_cast<int>(MotionEvidence::kStatic));
  space.static_for(cv::Rect(10, 10, 10, 2)).setTo(2.1F);
  space.static_for(cv::Rect(10, 12, 10, 1)).setTo(0.5F);
  space.static_for(cv::Rect(10, 13, 10, 1)).setTo(0.1F);
  space.state(cv::Rect(40, 10, 10, 7)).setTo(static_cast<int>(MotionEvidence::kMoving));
  const TrackedPoints flow{{{25.0F, 25.0F}, {27.0F, 30.0F}, {200.0F, 200.0F}}, {{85.0F, 25.0F}}, 1.0};
  const auto evidence = evidence_by_owner(owners, 2, space, flow, grid, {});
  ASSERT_EQ(evidence.size(), 3U);
  EXPECT_EQ(evidence[0].cells, grid.size().area() - 200);
  EXPECT_EQ(evidence[0].known, 0);
  EXPECT_EQ(evidence[0].flow_at_rest, 1);
  EXPECT_EQ(evidence[1].cells, 100);
  EXPECT_EQ(evidence[1].known, 40);
  EXPECT_EQ(evidence[1].moving, 0);
  EXPECT_EQ(evidence[1].at_rest_long, 20);
  EXPECT_EQ(evidence[1].at_rest_briefly, 30);
  EXPECT_EQ(evidence[1].flow_at_rest, 2);
  EXPECT_EQ(evidence[1].flow_moving, 0);
  EXPECT_EQ(evidence[2].moving, 70);
  EXPECT_EQ(evidence[2].known, 70);
  EXPECT_EQ(evidence[2].flow_moving, 1);
  EXPECT_TRUE(evidence[2].is_flow_fine);
  const TrackedPoints blurred{{}, {}, 4.0};
  EXPECT_FALSE(evidence_by_owner(owners, 2, space, blurred, grid, {})[1].is_flow_fine);
}

}  // namespace
}  // namespace roslam::scene
