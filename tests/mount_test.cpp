// SPDX-License-Identifier: BSD-3-Clause
// How a camera is mounted on its vehicle, and which way is up.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/mount.hpp"
#include "roslam/sensors/gravity.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180.0;

TEST(Mount, LooksAheadWithoutAngles) {
  const SE3 T_body_camera = mounted_camera({0.1, -0.2, 0.3, 0, 0, 0});
  EXPECT_TRUE((T_body_camera * Vector3d(0, 0, 1)).isApprox(Vector3d(1.1, -0.2, 0.3), 1e-12))
      << "optical axis";
  EXPECT_TRUE((T_body_camera.rotation() * Vector3d::UnitX()).isApprox(-Vector3d::UnitY(), 1e-12)) << "right";
  EXPECT_TRUE((T_body_camera.rotation() * Vector3d::UnitY()).isApprox(-Vector3d::UnitZ(), 1e-12)) << "down";
}

TEST(Mount, PositivePitchLooksDownAndPositiveYawLeft) {
  const Vector3d down = mount_from("0,0,0,0,20,0").rotation() * Vector3d::UnitZ();
  EXPECT_TRUE(down.isApprox(Vector3d(std::cos(20 * kDegree), 0, -std::sin(20 * kDegree)), 1e-12));
  const Vector3d left = mount_from("0,0,0,0,0,90").rotation() * Vector3d::UnitZ();
  EXPECT_TRUE(left.isApprox(Vector3d::UnitY(), 1e-12));
  // Rolled to the right, what the camera has on its right is below.
  const Vector3d right = mount_from("0,0,0,30,0,0").rotation() * Vector3d::UnitX();
  EXPECT_TRUE(right.isApprox(Vector3d(0, -std::cos(30 * kDegree), -std::sin(30 * kDegree)), 1e-12));
}

TEST(Mount, ThatCannotBeIsRefused) {
  for (const char* text : {"", "1,2,3", "0,0,0,0,0,0,0", "0;0;0;0;0;0", "a,0,0,0,0,0", "0,0,0,0,0,0 ",
                           "nan,0,0,0,0,0", "0,0,0,inf,0,0", "100,0,0,0,0,0", "0,0,0,0,1000,0"})
    EXPECT_THROW(mount_from(text), CalibrationError) << text;
}

TEST(Mount, IsReadFromTheCameraFileAndWrittenBack) {
  const auto folder = scratch_path();
  std::filesystem::create_directories(folder);
  Camera camera = *camera_preset("d455");
  camera.T_body_camera = mount_from("0.12,0.01,-0.04,2,20,-5");
  const auto file = folder / "camera.yaml";
  std::ofstream(file) << camera_to_yaml(camera);
  const Camera read = read_camera(file);
  EXPECT_LT((read.T_body_camera.inverse() * camera.T_body_camera).log().norm(), 1e-12);
  std::filesystem::remove_all(folder);
}

TEST(Mount, OfTheCameraFileMustBeARigidTransform) {
  const auto folder = scratch_path();
  std::filesystem::create_directories(folder);
  for (const char* value : {"[1, 2]", "[2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]", "level",
                            "[1, 0, 0, .nan, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
                            "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]"}) {
    const auto file = folder / "camera.yaml";
    std::ofstream(file) << camera_to_yaml(*camera_preset("d455")) << "T_body_camera: " << value << "\n";
    try {
      read_camera(file);
      FAIL() << value;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("T_body_camera"), std::string::npos) << error.what();
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(LevelAttitude, HasTheWorldsZAxisUpAndNoYaw) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const Vector3d up(0.5 * normal(random), 0.5 * normal(random), 1.0);
    const Eigen::Quaterniond R_world_body = level_attitude(9.81 * up);
    EXPECT_TRUE((R_world_body * up.normalized()).isApprox(Vector3d::UnitZ(), 1e-12));
    const Vector3d ahead = R_world_body * Vector3d::UnitX();
    EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.0, 1e-12);
  }
}

TEST(LevelAttitude, IsDefinedWhereTheBodyPointsUpOrDown) {
  for (const double sign : {-1.0, 1.0}) {
    const Eigen::Quaterniond R = level_attitude({sign, 0.0, 0.0});
    EXPECT_TRUE((R * Vector3d(sign, 0, 0)).isApprox(Vector3d::UnitZ(), 1e-12));
    EXPECT_NEAR(R.norm(), 1.0, 1e-12);
  }
}

std::vector<InertialSample> at_rest(const Eigen::Quaterniond& R_world_imu, double from, double until,
                                    double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, noise);
  std::vector<InertialSample> samples;
  for (double t = from; t <= until; t += 0.005) {
    InertialSample sample{t, {}, R_world_imu.inverse() * Vector3d(0, 0, 9.81)};
    sample.turn_rate.setZero();
    for (int k = 0; k < 3; ++k) sample.acceleration(k) += normal(random);
    samples.push_back(sample);
  }
  return samples;
}

double degrees_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

TEST(Gravity, AtRestIsTheMeanOfTheAccelerometer) {
  const Eigen::Quaterniond R(Eigen::AngleAxisd(0.4, Vector3d(0.3, 0.5, 0.1).normalized()));
  GravityEstimator gravity;
  EXPECT_FALSE(gravity.up_in_imu());
  gravity.add(at_rest(R, 0.0, 1.0, 0.1));
  ASSERT_TRUE(gravity.up_in_imu());
  EXPECT_LT(degrees_between(*gravity.up_in_imu(), R.inverse() * Vector3d::UnitZ()), 0.3);
}

TEST(Gravity, IsNotWhatFallsOrIsNotANumber) {
  GravityEstimator gravity;
  std::vector<InertialSample> samples = at_rest({1, 0, 0, 0}, 0.0, 1.0, 0.0);
  for (auto& sample : samples) sample.acceleration *= 0.1;
  gravity.add(samples);
  EXPECT_FALSE(gravity.up_in_imu()) << "free fall";
  gravity.restart_clock();
  for (auto& sample : samples) sample.acceleration.setConstant(std::nan(""));
  gravity.add(samples);
  EXPECT_FALSE(gravity.up_in_imu());
}

// A flight that accelerates all the time in one direction, in a world frame that is tilted by 5 degrees.
TEST(Gravity, InFlightIsFoundWithTheVelocities) {
  const Eigen::Quaterniond R_world_level(Eigen::AngleAxisd(5 * kDegree, Vector3d(1, 2, 0).normalized()));
  const Vector3d up = R_world_level * Vector3d::UnitZ();
  const Vector3d acceleration = R_world_level * Vector3d(1.5, -0.5, 0.2);
  GravityEstimator gravity;
  for (int i = 0; i <= 90; ++i) {
    const double time = i / 30.0;
    const auto R_at = [](double t) {
      return Eigen::Quaterniond(Eigen::AngleAxisd(1.5 * t, Vector3d(0.2, 0.1, 1.0).normalized()));
    };
    std::vector<InertialSample> samples;
    for (double t = time - 1.0 / 30.0 + 0.005; t <= time + 1e-9; t += 0.005) {
      InertialSample sample;
      sample.timestamp = t;
      sample.acceleration = R_at(t).inverse() * (acceleration + 9.81 * up);
      samples.push_back(sample);
    }
    gravity.add(samples);
    gravity.track({time, R_at(time), acceleration * time});
    if (time < 1.9) {
      EXPECT_FALSE(gravity.up_in_world(2.0));
    }
  }
  ASSERT_TRUE(gravity.up_in_world(2.0));
  EXPECT_LT(degrees_between(*gravity.up_in_world(2.0), up), 0.1);
  gravity.track({10.0, Eigen::Quaterniond::Identity(), Vector3d::Zero()});
  EXPECT_FALSE(gravity.up_in_world(2.0)) << "a gap begins anew";
}

}  // namespace
}  // namespace roslam
