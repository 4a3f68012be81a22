// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/removal_error.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "roslam/common/error.hpp"

namespace roslam {

using namespace evaluation;
namespace {

constexpr int kStep = 20;  // pixels from dot to dot
constexpr int kColumns = 13;
constexpr int kRows = 9;
const cv::Size kImage{320, 240};

// 13 x 9 dots at (30, 30), (50, 30) ...; each is one corner.
cv::Mat dots() {
  cv::Mat grey(kImage, CV_8UC1, cv::Scalar(100));
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const cv::Point dot(30 + kStep * column, 30 + kStep * row);
      cv::Mat(grey, cv::Rect(dot - cv::Point(1, 1), cv::Size(3, 3))) = 200;
      grey.at<std::uint8_t>(dot) = 250;
    }
  }
  return grey;
}

cv::Mat nothing() { return cv::Mat::zeros(kImage, CV_8UC1); }

// Columns of pixels from begin up to end, without it.
cv::Mat columns(int begin, int end) {
  cv::Mat mask = nothing();
  mask.colRange(begin, end) = 255;
  return mask;
}

OrbOptions exact() {
  OrbOptions options;
  options.levels = 1;
  options.mask_margin = 0;
  return options;
}

RemovalError compared(const MovingTruth& truth, const RemovedThings& run, int margin = 0) {
  RemovalComparison comparison(exact(), margin);
  comparison.add(dots(), truth, run);
  return comparison.error();
}

TEST(RemovalError, CountsWhatPointsLieOn) {
  // Dots in columns 0-3 are on the actor, column 4 is 10 pixels from it, columns 9 and 10 rest.
  const MovingTruth truth{columns(0, 101), columns(200, 240)};
  cv::Mat mask = columns(0, 60) | columns(200, 240) | columns(260, 320);
  mask(cv::Rect(105, 0, 10, 100)) = 1;
  const RemovalError error = compared(truth, {mask, {}, {}});
  EXPECT_EQ(error.on_actors, (PointTally{18, 18}));
  EXPECT_EQ(error.near_actors, (PointTally{5, 4}));
  EXPECT_EQ(error.beyond, (PointTally{45, 9}));
  EXPECT_EQ(error.at_rest, (PointTally{0, 18}));
  EXPECT_EQ(error.on_static_scene(), (PointTally{50, 13}));
  EXPECT_DOUBLE_EQ(error.on_actors.kept_share(), 0.5);
  EXPECT_EQ(error.run_points, 68u);
  EXPECT_EQ(error.run_points_on_actors, 18u);
  EXPECT_DOUBLE_EQ(error.actor_recall(), 60.0 / 101.0);
  EXPECT_DOUBLE_EQ(error.actor_share(), 101.0 / 320.0);
  EXPECT_DOUBLE_EQ(error.removed_share(), (160.0 * 240.0 + 1000.0) / (320.0 * 240.0));
  EXPECT_EQ(error.frames, 1u);
  EXPECT_EQ(error.unlike_run, 0u);
}

TEST(RemovalError, NearIsMeasuredToTheSilhouette) {
  EXPECT_EQ(compared({columns(0, 100), {}}, {}).near_actors,
            PointTally{});  // the next dots are 11 pixels off
  EXPECT_EQ(compared({columns(0, 101), {}}, {}).near_actors, (PointTally{9, 0}));
  cv::Mat corner = nothing();
  corner(cv::Rect(0, 0, 44, 44)) = 255;  // (50, 30) and (30, 50) are 7 pixels off, (50, 50) 9.9
  EXPECT_EQ(compared({corner, {}}, {}).near_actors, (PointTally{3, 0}));
  corner(cv::Rect(40, 40, 4, 4)) = 0;
  EXPECT_EQ(compared({corner, {}}, {}).near_actors, (PointTally{2, 0}));
}

TEST(RemovalError, DilatesTheMaskAsTheRunDid) {
  const MovingTruth truth{columns(0, 101), {}};
  const RemovedThings run{columns(0, 41), {}, {}};
  EXPECT_EQ(compared(truth, run).on_actors.removed, 9u);
  EXPECT_EQ(compared(truth, run, 9).on_actors.removed, 9u);
  EXPECT_EQ(compared(truth, run, 10).on_actors.removed, 18u);
  EXPECT_DOUBLE_EQ(compared(truth, run, 10).actor_recall(), 51.0 / 101.0);
}

// A mask frees part of the feature budget, which is then spent elsewhere: shares must not depend on that.
TEST(RemovalError, SharesAreOfThePointsWithoutAMask) {
  OrbOptions few = exact();
  few.features = 60;
  RemovalComparison comparison(few, 0);
  comparison.add(dots(), {columns(0, 101), {}}, {columns(101, 320), {}, {}});
  const RemovalError& error = comparison.error();
  EXPECT_EQ(error.on_actors.kept + error.on_static_scene().removed, 60u);
  EXPECT_EQ(error.on_actors.removed, 0u);
  EXPECT_EQ(error.on_static_scene().kept, 0u);
  EXPECT_LT(error.on_actors.kept, 30u);
  EXPECT_EQ(error.run_points, 36u);
  EXPECT_EQ(error.run_points_on_actors, 36u);
}

TEST(RemovalError, WithoutAMaskEverythingSurvives) {
  const RemovalError error = compared({columns(0, 101), {}}, {});
  EXPECT_EQ(error.on_actors, (PointTally{36, 0}));
  EXPECT_EQ(error.on_static_scene(), (PointTally{81, 0}));
  EXPECT_EQ(error.removed_share(), 0.0);
  EXPECT_EQ(error.actor_recall(), 0.0);
}

TEST(RemovalError, AddsUpOverFrames) {
  RemovalComparison comparison(exact(), 0);
  comparison.add(dots(), {columns(0, 101), {}}, {columns(0, 60), {}, {}});
  comparison.add(dots(), {columns(0, 101), {}}, {columns(0, 101), {}, {}});
  comparison.add(dots(), {nothing(), {}}, {});
  EXPECT_EQ(comparison.error().frames, 3u);
  EXPECT_EQ(comparison.error().on_actors, (PointTally{18, 54}));
  EXPECT_EQ(comparison.error().beyond, (PointTally{72 + 72 + 117, 0}));
}

TEST(RemovalError, LetsRestingThingsThroughWhereTheRunDid) {
  const MovingTruth truth{columns(0, 101), {}};
  const cv::Mat mask = columns(0, 60) | columns(200, 240);
  const cv::Mat resting = columns(200, 240);
  EXPECT_EQ(compared(truth, {mask, resting, CountedPoints{81, 36, 0}}).beyond, (PointTally{54, 18}));
  EXPECT_EQ(compared(truth, {mask, resting, CountedPoints{99, 18, 0}}).beyond, (PointTally{72, 0}));
  EXPECT_EQ(compared(truth, {mask, resting, CountedPoints{99, 18, 0}}).unlike_run, 0u);
  EXPECT_EQ(compared(truth, {mask, resting, {}}).beyond, (PointTally{54, 18}));
  EXPECT_EQ(compared(truth, {mask, resting, CountedPoints{80, 30, 0}}).beyond, (PointTally{54, 18}));
  EXPECT_EQ(compared(truth, {mask, resting, CountedPoints{80, 30, 0}}).unlike_run, 1u);
  EXPECT_EQ(compared(truth, {{}, {}, CountedPoints{116, 0, 0}}).unlike_run, 1u);
}

// The extractor keeps a margin around a mask; the number of corners removed there distinguishes images that
// have all the points the budget allows.
TEST(RemovalError, KnowsTheRunByItsPointsBesideTheMask) {
  OrbOptions options = exact();
  options.mask_margin = 12;  // pixels: from 60 to the dots at 70
  RemovalComparison comparison(options, 0);
  comparison.add(dots(), {nothing(), {}}, {columns(0, 61), {}, CountedPoints{90, 27, 9}});
  EXPECT_EQ(comparison.error().unlike_run, 0u);
  comparison.add(dots(), {nothing(), {}}, {columns(0, 61), {}, CountedPoints{90, 27, 8}});
  EXPECT_EQ(comparison.error().unlike_run, 1u);
  EXPECT_EQ(comparison.error().with_mask, 2u);
}

TEST(RemovalError, RefusesWhatDoesNotFit) {
  const cv::Mat small = cv::Mat::zeros(10, 10, CV_8UC1);
  const cv::Mat wide = cv::Mat::zeros(kImage, CV_16UC1);
  for (const cv::Mat& bad : {small, wide}) {
    EXPECT_THROW(compared({bad, {}}, {}), InputError);
    EXPECT_THROW(compared({nothing(), bad}, {}), InputError);
    EXPECT_THROW(compared({nothing(), {}}, {bad, {}, {}}), InputError);
    EXPECT_THROW(compared({nothing(), {}}, {nothing(), bad, {}}), InputError);
  }
  EXPECT_THROW(compared({{}, {}}, {}), InputError);
  EXPECT_THROW(RemovalComparison(exact(), -1), OptionsError);
}

TEST(RemovalError, ReportsSharesAndWhatHasNone) {
  RemovalError error = compared({columns(0, 101), columns(200, 240)}, {columns(0, 60), {}, {}});
  error.without_truth = 3;
  const std::string table = to_markdown(error);
  for (const char* words : {"actors kept: 50.0 %", "wrongly removed: 0.0 %", "1 frames\n", "| actors ",
                            "within 10 pixels", "59.4 % of the actors", "3 frames skipped"}) {
    EXPECT_NE(table.find(words), std::string::npos) << words << "\n" << table;
  }
  EXPECT_EQ(table.find("differs from the run"), std::string::npos) << table;
  const auto json = nlohmann::json::parse(to_json(error));
  EXPECT_EQ(json["actor_points"]["kept_share"], 0.5);
  EXPECT_EQ(json["static_points"]["kept"], 63);
  EXPECT_EQ(json["static_points"]["near"]["kept"], 9);
  EXPECT_EQ(json["static_points"]["beyond"]["removed_share"], 0.0);
  EXPECT_EQ(json["at_rest_points"]["kept"], 18);
  EXPECT_EQ(json["frames"]["without_truth"], 3);
  EXPECT_EQ(json["run_points"]["on_actors"], 18);
  EXPECT_EQ(json["interrupted"], false);
  const RemovalError empty = compared({nothing(), {}}, {});
  EXPECT_TRUE(nlohmann::json::parse(to_json(empty))["actor_points"]["kept_share"].is_null());
  EXPECT_NE(to_markdown(empty).find("actors kept: -;"), std::string::npos) << to_markdown(empty);
}

}  // namespace
}  // namespace roslam
