// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/brightness.hpp"

#include <gtest/gtest.h>

#include "roslam/features/orb_extractor.hpp"

namespace roslam {
namespace {

// Squares of random brightness between two grey values.
cv::Mat scene(int low, int high) {
  cv::Mat grey(480, 640, CV_8UC1);
  cv::RNG random(7);
  for (int y = 0; y < 480; y += 20) {
    for (int x = 0; x < 640; x += 20) grey(cv::Rect(x, y, 20, 20)) = random.uniform(low, high + 1);
  }
  return grey;
}

TEST(Brightness, WellExposedImagesAreNotTouched) {
  BrightnessNormaliser normaliser;
  const cv::Mat grey = scene(20, 230);
  normaliser.update(grey);
  EXPECT_FALSE(normaliser.is_on());
  EXPECT_EQ(normaliser.apply(grey).data, grey.data);
  EXPECT_EQ(normaliser.dark() + normaliser.flat(), 0u);
}

TEST(Brightness, DarkImagesGetCornersAndAreCounted) {
  BrightnessNormaliser normaliser;
  const cv::Mat dark = scene(0, 9);
  normaliser.update(dark);
  EXPECT_EQ(normaliser.dark(), 1u);
  OrbExtractor extractor{OrbOptions{}};
  const std::size_t before = extractor.extract(dark, {}).size();
  const std::size_t after = extractor.extract(normaliser.apply(dark), {}).size();
  EXPECT_GT(after, 500u);
  EXPECT_LT(before, after / 2) << "the control: the image was dark enough to lose corners";
}

TEST(Brightness, WarnsOfAFaultThatLasts) {
  BrightnessNormaliser normaliser;
  for (int i = 0; i < 9; ++i) normaliser.update(scene(0, 9));
  EXPECT_TRUE(normaliser.warnings().empty());
  normaliser.update(scene(0, 9));
  ASSERT_EQ(normaliser.warnings().size(), 1u);
  EXPECT_NE(normaliser.warnings().begin()->first.find("dark"), std::string::npos);
  for (int i = 0; i < 45; ++i) normaliser.update(scene(20, 230));
  EXPECT_TRUE(normaliser.warnings().empty()) << "a dark moment of a long flight";
}

TEST(Brightness, ImagesOfLittleContrastKeepTheirOffset) {
  BrightnessNormaliser normaliser;
  const cv::Mat hazy = scene(150, 170);
  normaliser.update(hazy);
  EXPECT_EQ(normaliser.flat(), 1u);
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(normaliser.apply(hazy), &low, &high);
  EXPECT_NEAR(low, 150.0, 1.0);
  EXPECT_GT(high - low, 55.0);
}

TEST(Brightness, TheStretchIsKeptWhileItFits) {
  BrightnessNormaliser normaliser;
  normaliser.update(scene(2, 14));
  const cv::Mat probe = scene(2, 14);
  const cv::Mat first = normaliser.apply(probe);
  normaliser.update(scene(2, 15));
  EXPECT_EQ(cv::norm(normaliser.apply(probe), first, cv::NORM_INF), 0.0);
  normaliser.update(scene(2, 40));
  EXPECT_GT(cv::norm(normaliser.apply(probe), first, cv::NORM_INF), 0.0);
}

TEST(Brightness, ABlackImageStaysBlack) {
  BrightnessNormaliser normaliser;
  const cv::Mat black = cv::Mat::zeros(480, 640, CV_8UC1);
  normaliser.update(black);
  EXPECT_EQ(cv::countNonZero(normaliser.apply(black)), 0);
  EXPECT_EQ(normaliser.dark(), 0u) << "there is nothing to stretch";
}

}  // namespace
}  // namespace roslam
