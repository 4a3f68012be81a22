// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_imu.hpp"

#include <cmath>
#include <numbers>

#include "roslam/common/timestamp.hpp"
#include "roslam/geometry/mount.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

constexpr double kRate = 200.0;               // Hz
constexpr double kGyroscopeNoise = 1.5e-3;    // rad/s/sqrt(Hz)
constexpr double kAccelerometerNoise = 5e-3;  // m/s^2/sqrt(Hz)
constexpr double kGravity = 9.81;             // m/s^2

Eigen::Vector3d noise(std::uint32_t seed) {
  return {normal(mix(seed, 0U)), normal(mix(seed, 1U)), normal(mix(seed, 2U))};
}

}  // namespace

ImuCalibration simulated_imu() {
  return {SE3(forward_camera().rotation().inverse(), Eigen::Vector3d(0.03, 0.005, -0.01)), 2e-3, 1e-4};
}

Eigen::Vector3d gyroscope_bias(double time, std::uint32_t seed) {
  constexpr double kConstant = 0.02;  // rad/s
  constexpr double kChange = 0.002;
  constexpr double kPeriod = 60.0;  // seconds
  const Eigen::Vector3d constant = kConstant * noise(mix(seed, 0x9b1a5U));
  return constant + kChange * std::sin(2 * std::numbers::pi * time / kPeriod) * Eigen::Vector3d::Ones();
}

std::vector<InertialSample> inertial_samples(const Flight& flight, double after, double until,
                                             std::uint32_t seed) {
  const SE3 T_camera_imu = simulated_imu().T_camera_imu;
  const auto T_world_imu = [&](double time) { return flight.T_world_camera(time) * T_camera_imu; };
  constexpr double kHalf = 0.5 / kRate;  // seconds; a gyroscope gives the mean rate of its interval
  constexpr double kSmooth = 0.03;       // seconds; the flight is smooth over that
  std::vector<InertialSample> samples;
  for (auto i = static_cast<long long>(std::floor(after * kRate + 1e-6)) + 1;
       static_cast<double>(i) <= until * kRate + 1e-6; ++i) {
    const double time = static_cast<double>(i) / kRate;
    const auto bits = mix(seed, static_cast<std::uint32_t>(i), 0x13aU);
    const SE3 here = T_world_imu(time);
    const SE3 turned = T_world_imu(time - kHalf).inverse() * T_world_imu(time + kHalf);
    const Eigen::Vector3d acceleration =
        (T_world_imu(time - kSmooth).translation() - 2.0 * here.translation() +
         T_world_imu(time + kSmooth).translation()) /
        (kSmooth * kSmooth);
    InertialSample sample;
    sample.timestamp = seconds_of(nanoseconds_of(time));
    sample.turn_rate = so3_log(turned.rotation()) * kRate + gyroscope_bias(time, seed) +
                       kGyroscopeNoise * std::sqrt(kRate) * noise(bits);
    sample.acceleration = here.rotation().inverse() * (acceleration + kGravity * Eigen::Vector3d::UnitZ()) +
                          kAccelerometerNoise * std::sqrt(kRate) * noise(mix(bits, 7U));
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace roslam::simulation
