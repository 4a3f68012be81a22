// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/evaluation/restoration_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "roslam/error.hpp"
#include "roslam/evaluation/picture_error.hpp"

namespace roslam {
namespace {

const cv::Size kSize(160, 120);

cv::Mat noisy(int seed) {
  cv::Mat picture(kSize, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(picture, cv::RNG::UNIFORM, 20, 200);
  return picture;
}

cv::Mat box(const cv::Rect& where) {
  cv::Mat mask = cv::Mat::zeros(kSize, CV_8UC1);
  mask(where).setTo(255);
  return mask;
}

// The left half of the hole is reprojected, the right half invented.
RestoredPicture perfect() {
  RestoredPicture picture;
  picture.truth = noisy(1);
  picture.estimate = picture.truth.clone();
  picture.hole = box({40, 40, 60, 50});
  picture.provenance = cv::Mat::zeros(kSize, CV_8UC1);
  picture.provenance(cv::Rect(40, 40, 30, 50)).setTo(static_cast<double>(Provenance::kReprojected));
  picture.provenance(cv::Rect(70, 40, 30, 50)).setTo(static_cast<double>(Provenance::kInvented));
  picture.true_depth = cv::Mat(kSize, CV_32FC1, cv::Scalar(2.0));
  picture.estimated_depth = picture.true_depth.clone();
  return picture;
}

RestorationError error_of(const RestoredPicture& picture) {
  RestorationComparison comparison;
  comparison.add(picture);
  return comparison.error();
}

TEST(PictureError, AConstantDifferenceHasTheErrorOneCanWorkOut) {
  const cv::Mat truth = noisy(1);
  const cv::Mat estimate = truth + cv::Scalar::all(10);
  const cv::Mat where = box({10, 10, 50, 50});
  EXPECT_DOUBLE_EQ(mean_square_error(truth, estimate, where), 100.0);
  EXPECT_DOUBLE_EQ(mean_absolute_error(truth, estimate, where), 10.0);
  EXPECT_NEAR(psnr(100.0), 28.1308, 1e-4);
  EXPECT_DOUBLE_EQ(psnr(0.0), 100.0);
}

TEST(PictureError, OnlyThePixelsAskedForCount) {
  const cv::Mat truth = noisy(1);
  cv::Mat estimate = truth.clone();
  estimate(cv::Rect(100, 80, 30, 30)).setTo(0);
  EXPECT_EQ(mean_square_error(truth, estimate, box({10, 10, 50, 50})), 0.0);
  EXPECT_TRUE(std::isnan(mean_square_error(truth, estimate, box({}))));
  EXPECT_TRUE(std::isnan(ssim(truth, estimate, box({}))));
}

TEST(PictureError, StructuralSimilarityIsOneForTheSameAndAboutNoneForOther) {
  const cv::Mat where = box({20, 20, 100, 80});
  EXPECT_NEAR(ssim(noisy(1), noisy(1), where), 1.0, 1e-9);
  EXPECT_LT(ssim(noisy(1), noisy(2), where), 0.25);
  // A flat picture in place of one: by the formula 2 ab + c1 over a2 + b2 + c1, as nothing varies.
  const cv::Mat a(kSize, CV_8UC3, cv::Scalar::all(100)), b(kSize, CV_8UC3, cv::Scalar::all(120));
  const double c1 = 2.55 * 2.55;
  EXPECT_NEAR(ssim(a, b, where), (2 * 100 * 120 + c1) / (100 * 100 + 120 * 120 + c1), 1e-6);
}

TEST(RestorationComparison, APerfectPictureHasNoError) {
  const auto error = error_of(perfect());
  EXPECT_EQ(error.with_hole, 1U);
  EXPECT_EQ(error.hole_pixels, 3000U);
  EXPECT_EQ(error.reprojected_pixels, 1500U);
  EXPECT_EQ(error.invented_pixels, 1500U);
  EXPECT_EQ(error.psnr, 100.0);
  EXPECT_NEAR(error.ssim, 1.0, 1e-9);
  EXPECT_EQ(error.l1, 0.0);
  EXPECT_LT(error.depth_error_reprojected, 0.001);
  EXPECT_EQ(error.depth_known, 1.0);
  EXPECT_GT(error.true_points, 0U);
  EXPECT_EQ(error.matched_points, error.true_points);
  EXPECT_TRUE(std::isnan(error.movable_share));
}

TEST(RestorationComparison, ErrorsAreToldApartByProvenance) {
  auto picture = perfect();
  cv::Mat invented = picture.estimate(cv::Rect(70, 40, 30, 50));
  invented += cv::Scalar::all(20);
  picture.estimated_depth(cv::Rect(40, 40, 30, 50)).setTo(2.02);
  picture.estimated_depth(cv::Rect(70, 40, 30, 50)).setTo(1.8);
  picture.estimated_depth(cv::Rect(70, 40, 30, 10)).setTo(0);
  picture.movable = box({70, 40, 30, 10});
  const auto error = error_of(picture);
  EXPECT_EQ(error.psnr_reprojected, 100.0);
  EXPECT_NEAR(error.psnr_invented, psnr(400.0), 1e-6);
  EXPECT_NEAR(error.psnr, psnr(200.0), 1e-6);
  EXPECT_NEAR(error.l1, 10.0, 1e-6);
  EXPECT_NEAR(error.depth_error_reprojected, 0.01, 0.001);
  EXPECT_NEAR(error.depth_error_invented, 0.1, 0.001);
  EXPECT_NEAR(error.depth_known, 0.9, 1e-6);
  EXPECT_NEAR(error.movable_share, 0.2, 1e-6);
}

TEST(RestorationComparison, WhatIsOutsideTheHoleDoesNotCount) {
  auto picture = perfect();
  picture.estimate.setTo(0, ~picture.hole);
  picture.estimated_depth.setTo(9, ~picture.hole);
  const auto error = error_of(picture);
  EXPECT_EQ(error.psnr, 100.0);
  EXPECT_LT(error.depth_error_reprojected, 0.001);
}

TEST(RestorationComparison, ABlankHoleHasNoPoints) {
  auto picture = perfect();
  picture.estimate.setTo(90, picture.hole);
  EXPECT_LT(error_of(picture).matched_points, error_of(picture).true_points / 4);
}

TEST(RestorationComparison, TinyHolesAreCountedButNotScored) {
  auto picture = perfect();
  picture.hole = box({40, 40, 5, 5});
  const auto error = error_of(picture);
  EXPECT_EQ(error.pictures, 1U);
  EXPECT_EQ(error.with_hole, 0U);
  EXPECT_TRUE(std::isnan(error.psnr));
}

TEST(RestorationComparison, RefusesImagesThatDoNotFit) {
  for (int which = 0; which < 6; ++which) {
    auto picture = perfect();
    cv::Mat* images[] = {&picture.truth,      &picture.estimate,   &picture.hole,
                         &picture.provenance, &picture.true_depth, &picture.estimated_depth};
    cv::Mat& image = *images[which];
    image = image(cv::Rect(0, 0, 100, 100)).clone();
    RestorationComparison comparison;
    EXPECT_THROW(comparison.add(picture), InputError) << which;
  }
}

TEST(RestorationReport, HoldsNullWhereThereIsNothingToTell) {
  const auto json = nlohmann::json::parse(to_json(RestorationComparison().error()));
  EXPECT_TRUE(json.at("psnr_db").is_null());
  EXPECT_EQ(json.at("pictures"), 0);
  EXPECT_NE(to_markdown(error_of(perfect())).find("100.00 dB"), std::string::npos);
}

}  // namespace
}  // namespace roslam
