// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/restoration_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "evaluation/image_error.hpp"
#include "roslam/common/error.hpp"

namespace roslam {

using namespace evaluation;
namespace {

const cv::Size kSize(160, 120);

cv::Mat noisy(int seed) {
  cv::Mat image(kSize, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 20, 200);
  return image;
}

cv::Mat box(const cv::Rect& where) {
  cv::Mat mask = cv::Mat::zeros(kSize, CV_8UC1);
  mask(where).setTo(255);
  return mask;
}

// The left half of the hole is reprojected, the right half inpainted.
EvaluatedImage perfect() {
  EvaluatedImage image;
  image.truth = noisy(1);
  image.estimate = image.truth.clone();
  image.hole = box({40, 40, 60, 50});
  image.provenance = cv::Mat::zeros(kSize, CV_8UC1);
  image.provenance(cv::Rect(40, 40, 30, 50)).setTo(static_cast<double>(Provenance::kReprojected));
  image.provenance(cv::Rect(70, 40, 30, 50)).setTo(static_cast<double>(Provenance::kInpainted));
  image.true_depth = cv::Mat(kSize, CV_32FC1, cv::Scalar(2.0));
  image.estimated_depth = image.true_depth.clone();
  return image;
}

RestorationError error_of(const EvaluatedImage& image) {
  RestorationComparison comparison;
  comparison.add(image);
  return comparison.error();
}

TEST(ImageError, AConstantDifferenceHasTheErrorOneCanWorkOut) {
  const cv::Mat truth = noisy(1);
  const cv::Mat estimate = truth + cv::Scalar::all(10);
  const cv::Mat where = box({10, 10, 50, 50});
  EXPECT_DOUBLE_EQ(mean_square_error(truth, estimate, where), 100.0);
  EXPECT_DOUBLE_EQ(mean_absolute_error(truth, estimate, where), 10.0);
  EXPECT_NEAR(psnr(100.0), 28.1308, 1e-4);
  EXPECT_DOUBLE_EQ(psnr(0.0), 100.0);
}

TEST(ImageError, OnlyThePixelsAskedForCount) {
  const cv::Mat truth = noisy(1);
  cv::Mat estimate = truth.clone();
  estimate(cv::Rect(100, 80, 30, 30)).setTo(0);
  EXPECT_EQ(mean_square_error(truth, estimate, box({10, 10, 50, 50})), 0.0);
  EXPECT_TRUE(std::isnan(mean_square_error(truth, estimate, box({}))));
  EXPECT_TRUE(std::isnan(ssim(truth, estimate, box({}))));
}

TEST(ImageError, StructuralSimilarityIsOneForTheSameAndAboutNoneForOther) {
  const cv::Mat where = box({20, 20, 100, 80});
  EXPECT_NEAR(ssim(noisy(1), noisy(1), where), 1.0, 1e-9);
  EXPECT_LT(ssim(noisy(1), noisy(2), where), 0.25);
  // A flat image in place of one: by the formula 2 ab + c1 over a2 + b2 + c1, as nothing varies.
  const cv::Mat a(kSize, CV_8UC3, cv::Scalar::all(100)), b(kSize, CV_8UC3, cv::Scalar::all(120));
  const double c1 = 2.55 * 2.55;
  EXPECT_NEAR(ssim(a, b, where), (2 * 100 * 120 + c1) / (100 * 100 + 120 * 120 + c1), 1e-6);
}

TEST(RestorationComparison, APerfectImageHasNoError) {
  const auto error = error_of(perfect());
  EXPECT_EQ(error.with_hole, 1U);
  EXPECT_EQ(error.hole_pixels, 3000U);
  EXPECT_EQ(error.reprojected_pixels, 1500U);
  EXPECT_EQ(error.inpainted_pixels, 1500U);
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
  auto image = perfect();
  cv::Mat inpainted = image.estimate(cv::Rect(70, 40, 30, 50));
  inpainted += cv::Scalar::all(20);
  image.estimated_depth(cv::Rect(40, 40, 30, 50)).setTo(2.02);
  image.estimated_depth(cv::Rect(70, 40, 30, 50)).setTo(1.8);
  image.estimated_depth(cv::Rect(70, 40, 30, 10)).setTo(0);
  image.movable = box({70, 40, 30, 10});
  const auto error = error_of(image);
  EXPECT_EQ(error.psnr_reprojected, 100.0);
  EXPECT_NEAR(error.psnr_inpainted, psnr(400.0), 1e-6);
  EXPECT_NEAR(error.psnr, psnr(200.0), 1e-6);
  EXPECT_NEAR(error.l1, 10.0, 1e-6);
  EXPECT_NEAR(error.depth_error_reprojected, 0.01, 0.001);
  EXPECT_NEAR(error.depth_error_inpainted, 0.1, 0.001);
  EXPECT_NEAR(error.depth_known, 0.9, 1e-6);
  EXPECT_NEAR(error.movable_share, 0.2, 1e-6);
}

TEST(RestorationComparison, WhatIsOutsideTheHoleDoesNotCount) {
  auto image = perfect();
  image.estimate.setTo(0, ~image.hole);
  image.estimated_depth.setTo(9, ~image.hole);
  const auto error = error_of(image);
  EXPECT_EQ(error.psnr, 100.0);
  EXPECT_LT(error.depth_error_reprojected, 0.001);
}

TEST(RestorationComparison, ABlankHoleHasNoPoints) {
  auto image = perfect();
  image.estimate.setTo(90, image.hole);
  EXPECT_LT(error_of(image).matched_points, error_of(image).true_points / 4);
}

TEST(RestorationComparison, TinyHolesAreCountedButNotScored) {
  auto image = perfect();
  image.hole = box({40, 40, 5, 5});
  const auto error = error_of(image);
  EXPECT_EQ(error.images, 1U);
  EXPECT_EQ(error.with_hole, 0U);
  EXPECT_TRUE(std::isnan(error.psnr));
}

TEST(RestorationComparison, RefusesImagesThatDoNotFit) {
  for (int which = 0; which < 6; ++which) {
    auto image = perfect();
    cv::Mat* images[] = {&image.truth,      &image.estimate,   &image.hole,
                         &image.provenance, &image.true_depth, &image.estimated_depth};
    cv::Mat& part = *images[which];
    part = part(cv::Rect(0, 0, 100, 100)).clone();
    RestorationComparison comparison;
    EXPECT_THROW(comparison.add(image), InputError) << which;
  }
}

TEST(RestorationReport, HoldsNullWhereThereIsNothingToTell) {
  const auto json = nlohmann::json::parse(to_json(RestorationComparison().error()));
  EXPECT_TRUE(json.at("psnr_db").is_null());
  EXPECT_EQ(json.at("images"), 0);
  EXPECT_NE(to_markdown(error_of(perfect())).find("100.00 dB"), std::string::npos);
}

}  // namespace
}  // namespace roslam
