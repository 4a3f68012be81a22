// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "evaluation/odometry_error.hpp"
#include "recording/odometry_file.hpp"
#include "roslam/common/error.hpp"
#include "roslam/geometry/mount.hpp"
#include "tests/scratch.hpp"

namespace roslam::evaluation {
namespace {

namespace fs = std::filesystem;
constexpr double kInterval = 1.0 / 30.0;  // seconds
const SE3 kMount = mounted_camera({0.1, 0.0, -0.05, 0.0, 20.0, 0.0});

// A body that swings along a line ahead of it while it turns: position 2 sin(t) m, heading 0.5 t.
SE3 body_at(double t) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * t, Eigen::Vector3d::UnitZ())),
          {2.0 * std::sin(t), 1.0, 0.5}};
}

Eigen::Vector3d velocity_at(double t) {
  return body_at(t).rotation().inverse() * Eigen::Vector3d(2.0 * std::cos(t), 0.0, 0.0);
}

class OdometryEvaluation : public testing::Test {
 protected:
  OdometryEvaluation() {
    for (int i = 0; i < 300; ++i) {
      const double t = i * kInterval;
      truth_.push_back({t, body_at(t) * kMount});
      Odometry o;
      o.timestamp = t;
      o.T_odom_body = body_at(0.0).inverse() * body_at(t);
      o.T_map_odom = body_at(0.0);
      o.linear_velocity = velocity_at(t);
      o.angular_velocity = {0.0, 0.0, 0.5};
      o.covariance = o.velocity_covariance = 1e-4 * Matrix6d::Identity();
      odometry_.push_back(o);
    }
  }

  OdometryError evaluated() const { return evaluate_odometry(truth_, odometry_, kMount); }

  Trajectory truth_;
  std::vector<Odometry> odometry_;
};

TEST_F(OdometryEvaluation, ExactOdometryHasNoError) {
  const OdometryError error = evaluated();
  EXPECT_EQ(error.frames, 300U);
  EXPECT_EQ(error.compared, 298U) << "the first and the last have one neighbour only";
  EXPECT_LT(error.step.max, 1e-9);
  EXPECT_LT(error.step_rotation.max, 1e-5);
  EXPECT_LT(error.velocity.max, 1e-3) << "of central differences";
  EXPECT_LT(error.turn_rate.max, 1e-3);
  EXPECT_LT(error.largest_correction, 1e-9);
  EXPECT_LT(error.tilt, 1e-5);
  ASSERT_TRUE(error.delay);
  EXPECT_NEAR(*error.delay, 0.0, 0.003);
}

TEST_F(OdometryEvaluation, FindsTheDelayOfTheVelocity) {
  for (Odometry& o : odometry_) o.linear_velocity = velocity_at(o.timestamp - 0.06);
  const OdometryError error = evaluated();
  ASSERT_TRUE(error.delay);
  EXPECT_NEAR(*error.delay, 0.06, 0.005);
  EXPECT_GT(error.velocity.rmse, 0.05);
}

TEST_F(OdometryEvaluation, DoesNotTellADelayFromAConstantVelocity) {
  for (std::size_t i = 0; i < odometry_.size(); ++i) {
    const double t = odometry_[i].timestamp;
    const SE3 body(Eigen::Quaterniond::Identity(), {1.5 * t, 0.0, 0.0});
    truth_[i].T_world_camera = body * kMount;
    odometry_[i].T_odom_body = body;
    odometry_[i].linear_velocity = {1.5 + 0.01 * std::sin(50.0 * t), 0.0, 0.0};
  }
  EXPECT_FALSE(evaluated().delay);
}

TEST_F(OdometryEvaluation, ComparesVelocitiesWithTheirCovariance) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.05);
  for (Odometry& o : odometry_) {
    o.linear_velocity += Eigen::Vector3d(noise(random), noise(random), noise(random));
    o.angular_velocity += Eigen::Vector3d(noise(random), noise(random), noise(random));
    o.velocity_covariance = 0.05 * 0.05 * Matrix6d::Identity();
  }
  OdometryError error = evaluated();
  EXPECT_NEAR(error.nees, 6.0, 0.6);
  EXPECT_LT(error.below_bounds + error.above_bounds, 0.03);
  EXPECT_NEAR(error.velocity.rmse, 0.05 * std::sqrt(3.0), 0.006);
  for (Odometry& o : odometry_) o.velocity_covariance *= 0.1;
  error = evaluated();
  EXPECT_GT(error.above_bounds, 0.8);
  for (Odometry& o : odometry_) o.velocity_covariance *= 1000.0;
  EXPECT_GT(evaluated().below_bounds, 0.9);
}

TEST_F(OdometryEvaluation, AJumpIsAStepUnlessItIsAReset) {
  const SE3 aside(Eigen::Quaterniond::Identity(), {0.0, 0.3, 0.0});
  for (std::size_t i = 150; i < odometry_.size(); ++i)
    odometry_[i].T_odom_body = aside * odometry_[i].T_odom_body;
  EXPECT_NEAR(evaluated().step.max, 0.3, 1e-6);
  for (std::size_t i = 150; i < odometry_.size(); ++i) odometry_[i].resets = 1;
  EXPECT_LT(evaluated().step.max, 1e-9);
  EXPECT_EQ(evaluated().resets, 1U);
}

TEST_F(OdometryEvaluation, ACorrectionOfTheMapIsNoStep) {
  const SE3 aside(Eigen::Quaterniond::Identity(), {0.0, 0.3, 0.4});
  for (std::size_t i = 150; i < odometry_.size(); ++i)
    odometry_[i].T_map_odom = aside * odometry_[i].T_map_odom;
  EXPECT_LT(evaluated().step.max, 1e-9);
  EXPECT_NEAR(evaluated().largest_correction, 0.5, 1e-9);
}

TEST_F(OdometryEvaluation, TellsATiltedMap) {
  const Eigen::AngleAxisd tilt(2.0 * std::numbers::pi / 180.0, Eigen::Vector3d(1.0, 1.0, 0.0).normalized());
  const Eigen::AngleAxisd heading(1.0, Eigen::Vector3d::UnitZ());  // is no tilt
  const SE3 turn(Eigen::Quaterniond(tilt) * Eigen::Quaterniond(heading), {1.0, 2.0, 3.0});
  for (Odometry& o : odometry_) o.T_map_odom = turn * o.T_map_odom;
  EXPECT_NEAR(evaluated().tilt, 2.0, 1e-6);
}

TEST_F(OdometryEvaluation, RefusesTheTruthOfAnotherRecording) {
  for (StampedPose& pose : truth_) pose.timestamp += 1000.0;
  EXPECT_THROW(evaluated(), InputError);
  odometry_.clear();
  EXPECT_THROW(evaluated(), InputError);
}

TEST_F(OdometryEvaluation, ReportsWhatCannotBeToldAsAbsent) {
  OdometryError error = evaluated();
  error.delay.reset();
  EXPECT_NE(to_markdown({{"run", error}}).find(" - "), std::string::npos);
  EXPECT_NE(to_json({{"run", error}}).find("\"delay_ms\": null"), std::string::npos);
}

class OdometryFile : public OdometryEvaluation {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  std::string lines() const {
    std::string text = recording::odometry_header();
    for (const Odometry& o : odometry_) {
      FrameResult result;
      result.timestamp = o.timestamp;
      result.state = o.is_predicted ? TrackingState::kPredicted : TrackingState::kTracking;
      result.odometry = o;
      text += recording::odometry_line(result);
    }
    return text;
  }

  std::vector<Odometry> read(const std::string& text) const {
    std::ofstream(file_) << text;
    return recording::read_odometry(file_);
  }

  const fs::path folder_ = scratch_path();
  const fs::path file_ = folder_ / "odometry.csv";
};

TEST_F(OdometryFile, IsReadAsItWasWritten) {
  odometry_[7].resets = 3;
  odometry_[8].is_predicted = true;
  odometry_[9].velocity_covariance(2, 5) = odometry_[9].velocity_covariance(5, 2) = 0.003;
  const auto again = read(lines());
  ASSERT_EQ(again.size(), odometry_.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_NEAR(again[i].timestamp, odometry_[i].timestamp, 1e-6);
    EXPECT_LT((again[i].T_odom_body.inverse() * odometry_[i].T_odom_body).log().norm(), 1e-8);
    EXPECT_LT((again[i].T_map_odom.inverse() * odometry_[i].T_map_odom).log().norm(), 1e-8);
    EXPECT_LT((again[i].linear_velocity - odometry_[i].linear_velocity).norm(), 2e-6);
    EXPECT_LT((again[i].angular_velocity - odometry_[i].angular_velocity).norm(), 2e-6);
    EXPECT_TRUE(again[i].covariance.isApprox(odometry_[i].covariance));
    EXPECT_TRUE(again[i].velocity_covariance.isApprox(odometry_[i].velocity_covariance));
    EXPECT_EQ(again[i].resets, odometry_[i].resets);
    EXPECT_EQ(again[i].is_predicted, odometry_[i].is_predicted);
  }
}

TEST_F(OdometryFile, ALineThatWasCutOffIsPassedOver) {
  const std::string whole = lines();
  EXPECT_EQ(read(whole.substr(0, whole.size() - 40)).size(), odometry_.size() - 1);
  FrameResult lost;
  lost.no_pose = NoPose::kFewLandmarks;
  EXPECT_EQ(read(whole + recording::odometry_line(lost)).size(), odometry_.size());
}

TEST_F(OdometryFile, ADamagedLineIsNamed) {
  const std::string good = lines();
  for (const std::string& bad :
       {std::string("1.0,tracking,1\n"), "1.0,tracking,x" + std::string(64, ',') + "\n", std::string("\xff\n")}) {
    try {
      read(good + bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("line 302"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(recording::read_odometry(folder_ / "absent.csv"), InputError);
}

}  // namespace
}  // namespace roslam::evaluation
