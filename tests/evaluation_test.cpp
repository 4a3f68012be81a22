// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "evaluation/plots/plot.hpp"
#include "evaluation/point_grid.hpp"
#include "evaluation/trajectory_error.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "roslam/common/error.hpp"
#include "tests/scratch.hpp"

namespace roslam {

using namespace evaluation;
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

StampedPose at(double time, double x, double y, double z) {
  return {time, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, y, z))};
}

// A winding path whose camera turns too.
Trajectory winding(int count, double step) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double t = i * step;
    const Eigen::Vector3d position(2.0 * std::cos(0.7 * t), 3.0 * std::sin(0.4 * t), 0.3 * t);
    trajectory.push_back({100.0 + t, SE3(so3_exp({0.1 * t, 0.3 * std::sin(t), -0.2 * t}), position)});
  }
  return trajectory;
}

Trajectory moved(const SE3& motion, const Trajectory& trajectory) {
  Trajectory result;
  for (const auto& [time, pose] : trajectory) result.push_back({time, motion * pose});
  return result;
}

SE3 some_motion() {
  Vector6d tangent;
  tangent << 4.0, -7.0, 2.0, 0.9, -1.3, 0.4;
  return SE3::exp(tangent);
}

std::string refusal(const Trajectory& truth, const Trajectory& estimate,
                    const TrajectoryErrorOptions& options = {}) {
  try {
    evaluate_trajectory(truth, estimate, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Statistics, MatchesPaper) {
  const Statistics s = summarise({1.0, 2.0, 3.0, 6.0});
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 3.0);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(s.std_dev, std::sqrt(3.5));
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 6.0);
  EXPECT_EQ(summarise({5.0, 1.0, 2.0}).median, 2.0);
  EXPECT_EQ(summarise({}).count, 0u);
  EXPECT_TRUE(std::isnan(summarise({}).rmse));
}

TEST(Association, TakesTheNearestWithinTheToleranceAndEachOnce) {
  const Trajectory truth{at(0.0, 0, 0, 0), at(0.1, 1, 0, 0), at(0.2, 2, 0, 0)};
  const Trajectory estimate{at(0.015, 0, 0, 0), at(0.09, 0, 0, 0), at(0.105, 0, 0, 0), at(0.23, 0, 0, 0)};
  const auto pairs = associate(truth, estimate, {});
  ASSERT_EQ(pairs.size(), 2u);  // 0.09 lost its truth to 0.105, 0.23 is 0.03 away
  EXPECT_EQ(pairs[0].estimate.timestamp, 0.015);
  EXPECT_EQ(pairs[0].truth.timestamp, 0.0);
  EXPECT_EQ(pairs[1].estimate.timestamp, 0.105);
  EXPECT_EQ(pairs[1].truth.timestamp, 0.1);
  AssociationOptions wider;
  wider.max_time_difference = 0.03;
  EXPECT_EQ(associate(truth, estimate, wider).size(), 3u);
}

TEST(Association, CountsATimeExactlyAtTheToleranceIn) {
  const Trajectory truth{at(1305031229.5, 0, 0, 0)};
  EXPECT_EQ(associate(truth, {at(1305031229.52, 0, 0, 0)}, {}).size(), 1u);
  EXPECT_EQ(associate(truth, {at(1305031229.5201, 0, 0, 0)}, {}).size(), 0u);
}

TEST(Association, NeverRunsBackwardsInTime) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(0.0, 2.0);
  Trajectory truth;
  Trajectory estimate;
  std::vector<double> times(160);
  for (auto* trajectory : {&truth, &estimate}) {
    for (auto& time : times) time = uniform(generator);
    std::sort(times.begin(), times.end());
    for (const double time : times) trajectory->push_back(at(time, 0, 0, 0));
  }
  const auto pairs = associate(truth, estimate, {});
  EXPECT_GT(pairs.size(), 80u);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    EXPECT_GT(pairs[i].truth.timestamp, pairs[i - 1].truth.timestamp);
    EXPECT_GT(pairs[i].estimate.timestamp, pairs[i - 1].estimate.timestamp);
    EXPECT_LE(std::abs(pairs[i].truth.timestamp - pairs[i].estimate.timestamp), 0.020002);
  }
}

TEST(Association, InterpolatesBetweenNeighboursButNotAcrossGaps) {
  const SE3 turned(so3_exp({0, 0, 0.4}), {1, 2, 0});
  const Trajectory truth{{0.0, SE3()}, {0.1, turned}, {1.0, SE3()}};
  AssociationOptions options;
  options.interpolate = true;
  const auto pairs =
      associate(truth, {at(-0.01, 0, 0, 0), at(0.025, 0, 0, 0), at(0.1, 0, 0, 0), at(0.5, 0, 0, 0)}, options);
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_LT((pairs[0].truth.T_world_camera.translation() - Eigen::Vector3d(0.25, 0.5, 0)).norm(), 1e-12);
  EXPECT_NEAR(pairs[0].truth.T_world_camera.angle(), 0.1, 1e-12);
  EXPECT_EQ(pairs[1].truth.timestamp, 0.1);
}

// Corners of a 2 m by 1 m rectangle. The estimate lifts one diagonal by h and lowers the other: that is
// orthogonal to every translation and small rotation, so the best alignment is none, and each error is h.
TEST(AbsoluteError, OfFourPosesIsAsOnPaper) {
  const Trajectory truth{at(0, 0, 0, 0), at(1, 2, 0, 0), at(2, 2, 1, 0), at(3, 0, 1, 0)};
  const double h = 0.1;
  const Trajectory estimate{at(0, 0, 0, h), at(1, 2, 0, -h), at(2, 2, 1, h), at(3, 0, 1, -h)};
  const auto result = evaluate_trajectory(truth, estimate);
  EXPECT_EQ(result.pairs, 4u);
  EXPECT_NEAR(result.path_length, 5.0, 1e-12);
  EXPECT_NEAR(result.ate.rmse, h, 1e-12);
  EXPECT_NEAR(result.ate.median, h, 1e-12);
  EXPECT_NEAR(result.ate.std_dev, 0.0, 1e-12);
  EXPECT_NEAR(result.ate_percent, 2.0, 1e-10);
  EXPECT_NEAR(result.coverage, 1.0, 1e-12);
  EXPECT_LT((result.alignment.T_target_source.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
  // Each step differs from the true one by 2h upwards.
  EXPECT_NEAR(result.rpe_frame.translation.rmse, 2 * h, 1e-12);
  EXPECT_NEAR(result.rpe_frame.rotation.max, 0.0, 1e-9);
}

// On a line at -3, -1, 1, 3 with errors (+d, -d, -d, +d): no mean, no slope, so no alignment and no scale
// helps.
TEST(AbsoluteError, OnAStraightLineIsAsOnPaper) {
  const double d = 0.05;
  const Trajectory truth{at(0, -3, 0, 0), at(1, -1, 0, 0), at(2, 1, 0, 0), at(3, 3, 0, 0)};
  const Trajectory estimate{at(0, -3, d, 0), at(1, -1, -d, 0), at(2, 1, -d, 0), at(3, 3, d, 0)};
  EXPECT_NEAR(evaluate_trajectory(truth, estimate).ate.rmse, d, 1e-12);
}

TEST(AbsoluteError, ARigidMotionOfEitherChangesNothing) {
  const Trajectory truth = winding(90, 1.0 / 30);
  Trajectory estimate = truth;
  std::mt19937 generator(8);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (auto& [time, pose] : estimate) {
    Vector6d tangent;
    for (int k = 0; k < 6; ++k) tangent[k] = noise(generator);
    pose = pose * SE3::exp(tangent);
  }
  const auto before = evaluate_trajectory(truth, estimate);
  EXPECT_GT(before.ate.rmse, 0.02);
  for (const auto& after : {evaluate_trajectory(truth, moved(some_motion(), estimate)),
                            evaluate_trajectory(moved(some_motion(), truth), estimate)}) {
    EXPECT_NEAR(after.ate.rmse, before.ate.rmse, 1e-10);
    EXPECT_NEAR(after.ate.max, before.ate.max, 1e-10);
    EXPECT_NEAR(after.path_length, before.path_length, 1e-10);
    EXPECT_NEAR(after.rpe_frame.translation.rmse, before.rpe_frame.translation.rmse, 1e-10);
    EXPECT_NEAR(after.rpe_span.rotation.mean, before.rpe_span.rotation.mean, 1e-8);
  }
  const auto exact = evaluate_trajectory(truth, moved(some_motion(), truth));
  EXPECT_LT(exact.ate.max, 1e-12);
  EXPECT_LT((exact.alignment.T_target_source * some_motion()).log().norm(), 1e-10);
}

TEST(AbsoluteError, SimilarityRecoversAScaleThatARigidMotionDoesNot) {
  const Trajectory truth = winding(90, 1.0 / 30);
  Trajectory estimate;
  for (const auto& [time, pose] : truth)
    estimate.push_back({time, SE3(pose.rotation(), 0.4 * pose.translation())});
  estimate = moved(some_motion(), estimate);
  TrajectoryErrorOptions options;
  EXPECT_GT(evaluate_trajectory(truth, estimate, options).ate.rmse, 0.5);
  options.alignment = AlignmentModel::kSimilarity;
  const auto result = evaluate_trajectory(truth, estimate, options);
  EXPECT_NEAR(result.alignment.scale, 2.5, 1e-10);
  EXPECT_LT(result.ate.max, 1e-10);
  EXPECT_LT(result.rpe_span.translation.max, 1e-10);
}

TEST(RelativeError, OfAConstantDriftIsThatDrift) {
  Trajectory truth;
  Trajectory estimate;
  for (int i = 0; i < 61; ++i) {
    const double t = i / 20.0;
    truth.push_back(at(t, t, 0, 0));
    estimate.push_back(at(t, t, 0.2 * t, 0));  // 0.2 m/s sideways
  }
  const auto result = evaluate_trajectory(truth, estimate);
  EXPECT_EQ(result.rpe_frame.translation.count, 60u);
  EXPECT_NEAR(result.rpe_frame.translation.min, 0.01, 1e-12);
  EXPECT_NEAR(result.rpe_frame.translation.max, 0.01, 1e-12);
  EXPECT_EQ(result.rpe_span.translation.count, 41u);
  EXPECT_NEAR(result.rpe_span.translation.min, 0.2, 1e-12);
  EXPECT_NEAR(result.rpe_span.translation.max, 0.2, 1e-12);
  EXPECT_NEAR(result.rpe_span.rotation.max, 0.0, 1e-9);
}

TEST(RelativeError, OfASpinIsItsRate) {
  Trajectory truth;
  Trajectory estimate;
  for (int i = 0; i < 61; ++i) {
    const double t = i / 20.0;
    const SE3 pose(so3_exp({0, 0, 30.0 * kRadians * t}), {t, 0, 0});
    truth.push_back({t, pose});
    // 6 degrees a second about the camera's own axis on top, at the same places
    estimate.push_back({t, SE3(pose.rotation() * so3_exp({0, 0, 6.0 * kRadians * t}), pose.translation())});
  }
  const auto result = evaluate_trajectory(truth, estimate);
  EXPECT_NEAR(result.rpe_frame.rotation.rmse, 0.3, 1e-9);
  EXPECT_NEAR(result.rpe_span.rotation.rmse, 6.0, 1e-9);
  EXPECT_NEAR(result.rpe_span.rotation.max, 6.0, 1e-9);
  EXPECT_LT(result.ate.max, 1e-12);
}

TEST(RelativeError, LeavesOutStepsAcrossGapsAndCoverageTellsThem) {
  Trajectory truth;
  Trajectory estimate;
  for (int i = 0; i <= 100; ++i) {
    truth.push_back(at(0.1 * i, 0.1 * i, 0, 0));
    if (i <= 40 || i >= 60) estimate.push_back(at(0.1 * i, 0.1 * i, i >= 60 ? 5.0 : 0.0, 0));
  }
  const auto result = evaluate_trajectory(truth, estimate);
  EXPECT_EQ(result.pairs, 82u);
  EXPECT_EQ(result.rpe_frame.translation.count, 80u);
  EXPECT_NEAR(result.rpe_frame.translation.max, 0.0, 1e-12);
  EXPECT_NEAR(result.coverage, 0.8, 1e-9);
  EXPECT_GT(result.ate.rmse, 0.5);
}

TEST(RelativeError, IsEmptyWhereTheTrajectoryIsShorterThanTheSpan) {
  const auto result = evaluate_trajectory(winding(10, 0.05), winding(10, 0.05));
  EXPECT_EQ(result.rpe_span.translation.count, 0u);
  EXPECT_TRUE(std::isnan(result.rpe_span.translation.rmse));
  EXPECT_EQ(result.rpe_frame.translation.count, 9u);
}

// A drift is no wrong frame; a jump is, as is the way back, whether or not frames between were tracked.
TEST(WrongFrames, AreThoseWhoseStepIsOff) {
  const Trajectory truth = winding(100, 0.1);
  Trajectory estimate;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    SE3 pose = truth[i].T_world_camera;
    pose = SE3(so3_exp({0, 0, 0.002 * static_cast<double>(i)}), Eigen::Vector3d::Zero()) * pose;
    if (i >= 30 && i < 33) pose = pose * SE3(Eigen::Quaterniond::Identity(), {0.1, 0.0, 0.0});
    if (i == 50) pose = pose * SE3(so3_exp({5.0 * kRadians, 0, 0}), Eigen::Vector3d::Zero());
    if (i >= 80) pose = pose * SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.2});
    if (i < 70 || i >= 80) estimate.push_back({truth[i].timestamp, pose});
  }
  std::vector<double> times;
  const auto wrong = evaluate_trajectory(truth, estimate).wrong_frames;
  for (const WrongFrame& frame : wrong) times.push_back(frame.timestamp);
  ASSERT_EQ(times.size(), 5U);
  const std::size_t expected[] = {30, 33, 50, 51, 80};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(times[i], truth[expected[i]].timestamp) << i;
  EXPECT_NEAR(wrong[0].metres, 0.1, 0.01);
  EXPECT_NEAR(wrong[2].degrees, 5.0, 0.2);
  TrajectoryErrorOptions lenient;
  lenient.wrong_metres = 0.5;
  lenient.wrong_degrees = 10.0;
  EXPECT_TRUE(evaluate_trajectory(truth, estimate, lenient).wrong_frames.empty());
}

TEST(TrajectoryErrors, ToleratesAnOffsetInTimeUpToTheTolerance) {
  const Trajectory truth = winding(90, 0.1);
  Trajectory estimate = truth;
  for (auto& pose : estimate) pose.timestamp += 0.015;
  const auto result = evaluate_trajectory(truth, estimate);
  EXPECT_EQ(result.pairs, 90u);
  EXPECT_LT(result.ate.max, 1e-12);
  for (auto& pose : estimate) pose.timestamp += 0.015;
  EXPECT_NE(refusal(truth, estimate).find("only 0 poses"), std::string::npos) << refusal(truth, estimate);
}

TEST(TrajectoryErrors, RefusesWhatDoesNotOverlapAndNamesBothRanges) {
  const std::string message = refusal(winding(10, 1.0), {at(5, 0, 0, 0), at(6, 0, 0, 0), at(7.5, 0, 0, 0)});
  EXPECT_NE(message.find("do not overlap"), std::string::npos) << message;
  EXPECT_NE(message.find("100.000 to 109.000 s"), std::string::npos) << message;
  EXPECT_NE(message.find("5.000 to 7.500 s"), std::string::npos) << message;
  EXPECT_NE(refusal(winding(10, 1.0), winding(2, 1.0)).find("only 2 poses"), std::string::npos);
  EXPECT_FALSE(refusal({}, winding(2, 1.0)).empty());
}

TEST(TrajectoryErrors, EvaluatesAHoverAndAnEstimateThatNeverMoves) {
  const Trajectory truth = winding(30, 0.1);
  Trajectory stuck;
  for (const auto& pose : truth) stuck.push_back(at(pose.timestamp, 0, 0, 0));
  EXPECT_GT(evaluate_trajectory(truth, stuck).ate.rmse, 0.3);
  const auto hover = evaluate_trajectory(stuck, stuck);
  EXPECT_EQ(hover.ate.rmse, 0.0);
  EXPECT_TRUE(std::isnan(hover.ate_percent));
  TrajectoryErrorOptions options;
  options.alignment = AlignmentModel::kSimilarity;
  EXPECT_NE(refusal(truth, stuck, options).find("does not move"), std::string::npos);
}

TEST(TrajectoryErrors, OptionsNameWhatIsOutOfRange) {
  for (const double bad : {0.0, -1.0, 1.5, std::nan("")}) {
    TrajectoryErrorOptions options;
    options.association.max_time_difference = bad;
    EXPECT_THROW(options.validate(), OptionsError) << bad;
  }
  TrajectoryErrorOptions options;
  options.span = 0.0;
  EXPECT_THROW(options.validate(), OptionsError);
  options = {};
  options.wrong_metres = 0.0;
  EXPECT_THROW(options.validate(), OptionsError);
  options = {};
  options.wrong_degrees = std::nan("");
  EXPECT_THROW(options.validate(), OptionsError);
}

TEST(Plot, TicksAreRoundNumbersWithinTheRange) {
  EXPECT_EQ(nice_ticks({0.0, 10.0}, 6), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(tick_labels({-0.5, 0.0, 0.5}), (std::vector<std::string>{"-0.5", "0", "0.5"}));
  std::mt19937 generator(9);
  std::uniform_real_distribution<double> exponent(-6.0, 6.0);
  for (int i = 0; i < 500; ++i) {
    const double low = std::pow(10.0, exponent(generator)) * (i % 2 == 0 ? 1.0 : -1.0);
    const Range range{low, low + std::pow(10.0, exponent(generator))};
    const auto ticks = nice_ticks(range, 8);
    EXPECT_GE(ticks.size(), 2u) << range.min << " " << range.max;
    EXPECT_LE(ticks.size(), 8u) << range.min << " " << range.max;
    const double slack = 1e-6 * range.span();
    EXPECT_GE(ticks.front(), range.min - slack);
    EXPECT_LE(ticks.back(), range.max + slack);
  }
}

TEST(Plot, FiguresAreTheSameEachTimeAndSurviveDegenerateInput) {
  const Trajectory truth = winding(90, 0.1);
  const NamedTrajectoryError one{"one", evaluate_trajectory(truth, truth)};
  const cv::Mat figure = plot_trajectory_errors(truth, {one});
  ASSERT_FALSE(figure.empty());
  EXPECT_EQ(cv::norm(figure, plot_trajectory_errors(truth, {one}), cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(figure, plot_trajectory_errors(truth, {one, one}), cv::NORM_INF), 0.0);
  EXPECT_NO_THROW(plot_trajectory({truth[0]}, "a single pose"));
  EXPECT_NO_THROW(
      plot_trajectory(Trajectory{at(0, 1e9, -1e9, 0), at(1e-9, 1e9, -1e9, 0)}, std::string(500, 'n')));
  EXPECT_THROW(plot_trajectory({}, "none"), InputError);
  if (std::filesystem::exists("/dev/full")) {
    const auto link = scratch_path(".png");
    std::filesystem::remove(link);
    std::filesystem::create_symlink("/dev/full", link);
    EXPECT_THROW(write_png(link, figure), OutputError);
    std::filesystem::remove(link);
  }
  EXPECT_THROW(write_png("/no/such/folder/figure.png", figure), OutputError);
  EXPECT_THROW(write_png("figure.xyz", figure), OutputError);
}

TEST(PointGrid, FindsTheNearestWithinItsReach) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-1.0F, 1.0F);
  const auto any = [&] { return Eigen::Vector3f(place(random), place(random), place(random)); };
  std::vector<Eigen::Vector3f> points(500);
  for (auto& point : points) point = any();
  constexpr float kReach = 0.2F;
  const PointGrid grid(points, kReach);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3f from = any();
    const auto truth = std::min_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
      return (a - from).norm() < (b - from).norm();
    });
    const auto nearest = grid.nearest(from);
    ASSERT_EQ(nearest.has_value(), (*truth - from).norm() <= kReach);
    if (!nearest) continue;
    ++found;
    EXPECT_EQ(nearest->index, static_cast<std::size_t>(truth - points.begin()));
    EXPECT_NEAR(nearest->distance, (*truth - from).norm(), 1e-6F);
  }
  EXPECT_GT(found, 100);
  EXPECT_FALSE(PointGrid({}, kReach).nearest(any()).has_value());
}

}  // namespace
}  // namespace roslam
