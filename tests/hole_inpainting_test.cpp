// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>

#include "roslam/common/error.hpp"
#include "roslam/restoration/hole_inpainting.hpp"
#include "roslam/restoration/seam_blending.hpp"
#include "tests/restoration_scene.hpp"
#include "tests/scratch.hpp"

namespace roslam::scene {
namespace {

// Paints everything in the colour it thinks is around the hole, and notes what it was asked.
class FlatInpainter : public Inpainter {
 public:
  cv::Mat inpaint(const cv::Mat& crop, const cv::Mat& hole, const cv::Rect& square, Movable kind) override {
    EXPECT_EQ(crop.size(), cv::Size(kCropSide, kCropSide));
    EXPECT_EQ(hole.size(), crop.size());
    EXPECT_EQ(square.width, square.height);
    EXPECT_EQ(cv::boundingRect(hole) & square, cv::boundingRect(hole));
    kinds.push_back(kind);
    crops.push_back(crop.clone());
    holes.push_back(cv::countNonZero(hole));
    return cv::Mat(crop.size(), CV_8UC3, colour);
  }

  cv::Scalar colour{10, 200, 90};
  std::vector<Movable> kinds;
  std::vector<int> holes;
  std::vector<cv::Mat> crops;
};

const cv::Size kSize(320, 240);
const cv::Scalar kAround(40, 90, 160);

class Invention : public testing::Test {
 protected:
  cv::Mat hole(const std::vector<cv::Rect>& boxes) const {
    cv::Mat result = cv::Mat::zeros(kSize, CV_8UC1);
    for (const cv::Rect& box : boxes) result(box & cv::Rect({0, 0}, kSize)).setTo(255);
    return result;
  }

  cv::Mat image_ = cv::Mat(kSize, CV_8UC3, kAround);
  FlatInpainter inpainter_;
};

TEST_F(Invention, PaintsTheHoleAndNothingElse) {
  cv::randu(image_, 0, 255);
  const cv::Mat where = hole({{100, 80, 60, 70}});
  const cv::Mat result = inpaint_hole(image_, where, {{Movable::kCar, {95, 80, 70, 70}}}, &inpainter_);
  EXPECT_EQ(difference(result, image_, ~where), 0.0);
  EXPECT_EQ(inpainter_.kinds, std::vector{Movable::kCar});
}

TEST_F(Invention, ContentOfTheHoleDoesNotMatter) {
  const cv::Mat where = hole({{100, 80, 60, 70}});
  cv::Mat other = image_.clone();
  other.setTo(cv::Scalar(255, 0, 255), where);
  EXPECT_EQ(cv::norm(inpaint_hole(image_, where, {}, &inpainter_),
                     inpaint_hole(other, where, {}, &inpainter_), cv::NORM_INF),
            0.0);
  EXPECT_EQ(cv::norm(inpainter_.crops[0], inpainter_.crops[1], cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(inpaint_hole(image_, where, {}, nullptr), inpaint_hole(other, where, {}, nullptr),
                     cv::NORM_INF),
            0.0);
}

TEST_F(Invention, TakesTheLightOfTheSurroundings) {
  inpainter_.colour = kAround - cv::Scalar(20, 15, 10);  // the right image, painted too dark
  const cv::Mat where = hole({{100, 80, 60, 70}});
  const cv::Mat result = inpaint_hole(image_, where, {}, &inpainter_);
  EXPECT_LT(difference(result, image_, where), 1.0);
}

TEST_F(Invention, EachHoleHasTheClassOfItsRegion) {
  const cv::Mat where = hole({{10, 80, 70, 70}, {150, 80, 40, 40}, {250, 90, 30, 30}});
  const std::vector<RemovedRegion> regions{{Movable::kPerson, {10, 80, 70, 70}},
                                           {Movable::kBicycle, {150, 80, 40, 40}}};
  inpaint_hole(image_, where, regions, &inpainter_);
  // The largest first; what no region covers is unknown.
  EXPECT_EQ(inpainter_.kinds, (std::vector{Movable::kPerson, Movable::kBicycle, Movable::kUnknown}));
}

TEST_F(Invention, ADescriptorThatContradictsTheMaskIsNotBelieved) {
  const cv::Mat where = hole({{100, 80, 60, 70}});
  inpaint_hole(image_, where, {{Movable::kCar, {5, 5, 30, 30}}}, &inpainter_);
  inpaint_hole(image_, where, {{Movable::kCar, {-900, 4000, 30, 30}}, {Movable::kPerson, {}}}, &inpainter_);
  EXPECT_EQ(inpainter_.kinds, (std::vector{Movable::kUnknown, Movable::kUnknown}));
}

TEST_F(Invention, HolesNextToEachOtherArePaintedAtOnce) {
  inpaint_hole(image_, hole({{100, 80, 30, 60}, {140, 80, 30, 60}}), {}, &inpainter_);
  EXPECT_EQ(inpainter_.kinds.size(), 1U);
}

TEST_F(Invention, HundredsOfTinyHolesNeedNoNetwork) {
  std::vector<cv::Rect> boxes;
  for (int y = 5; y < kSize.height; y += 14)
    for (int x = 5; x < kSize.width; x += 14) boxes.emplace_back(x, y, 4, 3);
  const cv::Mat where = hole(boxes);
  const cv::Mat result = inpaint_hole(image_, where, {}, &inpainter_);
  EXPECT_TRUE(inpainter_.kinds.empty());
  EXPECT_LT(difference(result, image_, where), 2.0);
}

TEST_F(Invention, NoMoreCropsThanAllowed) {
  std::vector<cv::Rect> boxes;
  for (int x = 10; x < kSize.width; x += 60) boxes.emplace_back(x, 100, 20, 20);
  InpaintingOptions options;
  options.max_crops = 2;
  const cv::Mat where = hole(boxes);
  const cv::Mat result = inpaint_hole(image_, where, {}, &inpainter_, options);
  EXPECT_EQ(inpainter_.kinds.size(), 2U);
  cv::Mat black;
  cv::inRange(result, cv::Scalar::all(0), cv::Scalar::all(1), black);
  EXPECT_EQ(cv::countNonZero(black & where), 0);  // the others are filled too
}

TEST_F(Invention, HolesAtTheBorder) {
  for (const cv::Rect& box :
       {cv::Rect(0, 0, 50, 60), cv::Rect(280, 200, 40, 40), cv::Rect(0, 100, 320, 50)}) {
    const cv::Mat where = hole({box});
    inpainter_.colour = kAround;
    EXPECT_LT(difference(inpaint_hole(image_, where, {}, &inpainter_), image_, where), 1.0) << box;
    EXPECT_LT(difference(inpaint_hole(image_, where, {}, nullptr), image_, where), 4.0) << box;
  }
}

TEST_F(Invention, WithoutANetworkAClassicMethodPaints) {
  const cv::Mat where = hole({{100, 80, 60, 70}, {200, 20, 8, 8}});
  EXPECT_LT(difference(inpaint_hole(image_, where, {}, nullptr), image_, where), 4.0);
}

TEST_F(Invention, NoHoleAndNothingButHole) {
  EXPECT_EQ(cv::norm(inpaint_hole(image_, hole({}), {}, &inpainter_), image_, cv::NORM_INF), 0.0);
  EXPECT_TRUE(inpainter_.kinds.empty());
  const cv::Mat result = inpaint_hole(image_, hole({{0, 0, 320, 240}}), {}, &inpainter_);
  EXPECT_EQ(cv::norm(result, cv::Mat(kSize, CV_8UC3, cv::Scalar::all(128)), cv::NORM_INF), 0.0);
}

TEST_F(Invention, AlmostAllOfTheImageIsHole) {
  const cv::Mat where = hole({{3, 3, 314, 234}});
  const cv::Mat result = inpaint_hole(image_, where, {}, &inpainter_);
  EXPECT_EQ(inpainter_.kinds.size(), 1U);
  EXPECT_EQ(difference(result, image_, ~where), 0.0);
}

TEST(Seam, SpreadsADifferenceThatChangesAlongTheRim) {
  cv::Mat image(kSize, CV_8UC3), paint(kSize, CV_8UC3, cv::Scalar::all(100));
  for (int x = 0; x < kSize.width; ++x) image.col(x).setTo(cv::Scalar::all(90 + 20 * x / kSize.width));
  cv::Mat hole = cv::Mat::zeros(kSize, CV_8UC1);
  hole(cv::Rect(80, 60, 160, 120)).setTo(255);
  const cv::Mat matched = matched_to_rim(image, paint, dilated(hole, 12), hole);
  EXPECT_LT(difference(matched, image, hole), 1.0);
  EXPECT_GT(difference(paint, image, hole), 2.4);
}

TEST(Seam, WhatLightDoesNotExplainHasNoSay) {
  cv::Mat image(kSize, CV_8UC3, cv::Scalar::all(100)), paint = image.clone();
  cv::Mat hole = cv::Mat::zeros(kSize, CV_8UC1);
  hole(cv::Rect(80, 60, 160, 120)).setTo(255);
  image(cv::Rect(60, 60, 20, 120)).setTo(cv::Scalar::all(220));  // what a mask missed
  EXPECT_LT(difference(matched_to_rim(image, paint, dilated(hole, 12), hole), paint, hole), 0.5);
}

TEST(GanInpainter, NamesTheFileThatIsMissingOrDamaged) {
  const auto scratch = scratch_path();
  std::filesystem::create_directories(scratch);
  try {
    const GanInpainter inpainter(scratch);
    FAIL() << "no error";
  } catch (const ModelError& error) {
    EXPECT_NE(std::string(error.what()).find("roslam-restorer-person.onnx"), std::string::npos)
        << error.what();
  }
  std::ofstream(scratch / "roslam-restorer-person.onnx") << "no network";
  EXPECT_THROW(GanInpainter{scratch}, ModelError);
  std::filesystem::remove_all(scratch);
}

TEST(InpaintingOptions, NameTheFieldThatIsOutOfRange) {
  InpaintingOptions options;
  options.context = 0.5;
  EXPECT_THROW(options.validate(), OptionsError);
}

}  // namespace
}  // namespace roslam::scene
