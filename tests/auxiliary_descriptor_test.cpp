// SPDX-License-Identifier: BSD-3-Clause
// The auxiliary descriptor as the paper prints it, and the line of descriptors.jsonl it goes into.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "recording/removal_record.hpp"
#include "roslam/dynamic_objects/auxiliary_descriptor.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {

using namespace recording;
namespace {

using Json = nlohmann::json;

Eigen::Matrix4i matrix(const std::vector<int>& rows) {
  return Eigen::Map<const Eigen::Matrix<int, 4, 4, Eigen::RowMajor>>(rows.data());
}

const auto kPerson = [](const cv::Rect& box) { return boxed(box, Movable::kPerson); };

TEST(AuxiliaryDescriptor, IsZeroWhereNothingMoves) {
  EXPECT_EQ(auxiliary_descriptor({}), Eigen::Matrix4i::Zero());
}

TEST(AuxiliaryDescriptor, HasEachClassInItsCorner) {
  // Boxes with centre (u, v) and the larger side l; eq. 12 prints l u / v flag towards the middle.
  const cv::Rect tall(100, 40, 20, 60);  // u 110, v 70, l 60
  EXPECT_EQ(auxiliary_descriptor({boxed(tall, Movable::kPerson)}), matrix({60, 110, 0, 0,  //
                                                                           70, 1, 0, 0,    //
                                                                           0, 0, 0, 0,     //
                                                                           0, 0, 0, 0}));
  EXPECT_EQ(auxiliary_descriptor({boxed(tall, Movable::kCar)}), matrix({0, 0, 110, 60,  //
                                                                        0, 0, 1, 70,    //
                                                                        0, 0, 0, 0,     //
                                                                        0, 0, 0, 0}));
  EXPECT_EQ(auxiliary_descriptor({boxed(tall, Movable::kBicycle)}), matrix({0, 0, 0, 0,   //
                                                                            0, 0, 0, 0,   //
                                                                            70, 1, 0, 0,  //
                                                                            60, 110, 0, 0}));
  EXPECT_EQ(auxiliary_descriptor({boxed(tall, Movable::kUnknown)}), matrix({0, 0, 0, 0,   //
                                                                            0, 0, 0, 0,   //
                                                                            0, 0, 1, 70,  //
                                                                            0, 0, 110, 60}));
}

TEST(AuxiliaryDescriptor, HoldsTwoClassesSideBySide) {
  EXPECT_EQ(auxiliary_descriptor({boxed({200, 100, 80, 30}, Movable::kCar), kPerson({10, 20, 30, 90})}),
            matrix({90, 25, 240, 80,  //
                    65, 1, 1, 115,    //
                    0, 0, 0, 0,       //
                    0, 0, 0, 0}));
}

TEST(AuxiliaryDescriptor, HoldsAllFour) {
  EXPECT_EQ(auxiliary_descriptor({boxed({200, 150, 40, 40}, Movable::kUnknown), kPerson({10, 20, 30, 90}),
                                  boxed({50, 150, 60, 40}, Movable::kBicycle),
                                  boxed({200, 10, 80, 30}, Movable::kCar)}),
            matrix({90, 25, 240, 80,  //
                    65, 1, 1, 25,     //
                    170, 1, 1, 170,   //
                    60, 80, 220, 40}));
}

TEST(AuxiliaryDescriptor, TakesTheRegionWithMostPixelsOfAClass) {
  MovableObject thin = kPerson({100, 0, 100, 200});  // a large box with little in it
  thin.mask.colRange(2, 100).setTo(0);
  const auto most = kPerson({10, 20, 30, 90});
  const auto expected = auxiliary_descriptor({most});
  EXPECT_EQ(auxiliary_descriptor({kPerson({280, 10, 20, 40}), most, thin}), expected);
  EXPECT_EQ(auxiliary_descriptor({thin, most, kPerson({280, 10, 20, 40})}), expected);
}

class DescriptorLine : public testing::Test {
 protected:
  DescriptorLine() {
    result_.index = 17;
    result_.timestamp = 1305031102.175304;
    result_.state = TrackingState::kTracking;
    result_.T_world_camera = SE3();
    result_.quality = 0.75;
    result_.points = {{1.0F, 2.0F}, {200.0F, 200.0F}};
  }

  void remove(const std::vector<MovableObject>& objects) {
    result_.dynamic_objects.objects = objects;
    result_.dynamic_objects.label_age = 2;
    result_.dynamic_objects.mask = cv::Mat::zeros(kImage, CV_8UC1);
    for (const auto& object : objects) draw_object(object, result_.dynamic_objects.mask);
  }

  Json line(const std::string& mask_file = "") const {
    const std::string text = descriptor_line(result_, kImage, removed_by_class(result_, kImage), mask_file);
    EXPECT_EQ(text.find('\n'), std::string::npos);
    return Json::parse(text);
  }

  static std::vector<std::string> keys(const Json& json) {
    std::vector<std::string> names;
    for (const auto& [name, value] : json.items()) names.push_back(name);
    return names;
  }

  inline static const cv::Size kImage{320, 240};
  FrameResult result_;
};

TEST_F(DescriptorLine, SaysOfAnEmptyFrameThatItIsEmpty) {
  const Json json = line();
  EXPECT_EQ(keys(json),
            (std::vector<std::string>{"descriptor", "frame", "kept_points", "label_age", "mask", "objects",
                                      "quality", "removed_area", "removed_points", "state", "timestamp"}));
  EXPECT_EQ(json["frame"], 17);
  EXPECT_EQ(json["timestamp"].get<double>(), 1305031102.175304);
  EXPECT_EQ(json["state"], "tracking");
  EXPECT_EQ(json["quality"], 0.75);
  EXPECT_TRUE(json["label_age"].is_null());
  EXPECT_TRUE(json["mask"].is_null());
  EXPECT_EQ(json["descriptor"], Json::parse("[[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,0]]"));
  EXPECT_EQ(json["removed_area"], 0.0);
  EXPECT_EQ(json["kept_points"], 2);
  EXPECT_EQ(json["removed_points"], Json::object());
  EXPECT_EQ(json["objects"], Json::array());
}

TEST_F(DescriptorLine, DescribesEachThing) {
  auto person = kPerson({10, 20, 30, 90});
  person.id = 4;
  person.median_depth = 2.34567F;
  person.is_at_rest = true;
  auto car = boxed({200, 10, 80, 30}, Movable::kCar, 0.5F);
  car.id = 9;
  car.misses = 3;
  remove({person, car});
  result_.removed_points = {{15.0F, 30.0F}, {20.0F, 40.0F}, {210.0F, 20.0F}, {150.0F, 150.0F}};
  const Json json = line("masks/000017.png");
  EXPECT_EQ(json["descriptor"], Json::parse("[[90,25,240,80],[65,1,1,25],[0,0,0,0],[0,0,0,0]]"));
  EXPECT_EQ(json["mask"], "masks/000017.png");
  EXPECT_EQ(json["label_age"], 2);
  EXPECT_NEAR(json["removed_area"].get<double>(), (30 * 90 + 80 * 30) / (320.0 * 240.0), 1e-4);
  EXPECT_EQ(json["removed_points"], Json::parse(R"({"person": 2, "car": 1, "margin": 1})"));
  ASSERT_EQ(json["objects"].size(), 2U);
  const Json& first = json["objects"][0];
  EXPECT_EQ(keys(first), (std::vector<std::string>{"at_rest", "box", "centre", "class", "confidence", "id",
                                                   "median_depth", "missed", "pixels", "side", "value"}));
  EXPECT_EQ(first["id"], 4);
  EXPECT_EQ(first["value"], 1);
  EXPECT_EQ(first["class"], "person");
  EXPECT_EQ(first["confidence"], 0.9);
  EXPECT_EQ(first["box"], Json::parse("[10,20,30,90]"));
  EXPECT_EQ(first["centre"], Json::parse("[25,65]"));
  EXPECT_EQ(first["side"], 90);
  EXPECT_EQ(first["pixels"], 30 * 90);
  EXPECT_EQ(first["median_depth"], 2.346);
  EXPECT_EQ(first["at_rest"], true);
  EXPECT_EQ(first["missed"], 0);
  const Json& second = json["objects"][1];
  EXPECT_EQ(second["class"], "car");
  EXPECT_EQ(second["value"], 2);
  EXPECT_EQ(second["at_rest"], false);
  EXPECT_EQ(second["missed"], 3);
}

TEST_F(DescriptorLine, NumbersInTheMaskAreThoseOfTheLine) {
  const std::vector<MovableObject> objects{kPerson({10, 20, 30, 90}), kPerson({200, 10, 80, 30})};
  remove(objects);
  const cv::Mat image = object_image(objects, kImage);
  const Json json = line("a.png");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const cv::Mat own = image == json["objects"][i]["value"].get<int>();
    EXPECT_EQ(cv::boundingRect(own), objects[i].box);
    EXPECT_EQ(cv::countNonZero(own), objects[i].box.area());
  }
}

TEST_F(DescriptorLine, TheTallyAddsUpFrames) {
  RemovalTally tally;
  tally.add(result_, kImage, removed_by_class(result_, kImage));
  remove({kPerson({0, 0, 160, 240})});
  result_.removed_points = {{15.0F, 30.0F}};
  result_.quality = 0.4;
  tally.add(result_, kImage, removed_by_class(result_, kImage));
  result_.state = TrackingState::kPredicted;
  result_.quality = 0.0;
  tally.add(result_, kImage, removed_by_class(result_, kImage));
  result_.state = TrackingState::kLost;
  result_.T_world_camera.reset();
  tally.add(result_, kImage, removed_by_class(result_, kImage));
  EXPECT_EQ(tally.frames, 4U);
  EXPECT_DOUBLE_EQ(tally.removed_area, 1.5);
  EXPECT_EQ(tally.kept_points, 8U);
  EXPECT_EQ(tally.removed_points, (PointCounts{{"person", 3}}));
  EXPECT_EQ(tally.predicted, 1U);
  EXPECT_EQ(tally.low_quality, 2U);  // a frame without a pose has none to trust
  EXPECT_EQ(tally.label_ages, (std::vector<int>{2, 2, 2}));
}

}  // namespace
}  // namespace roslam::scene
