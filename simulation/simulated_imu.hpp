// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "roslam/geometry/imu_calibration.hpp"
#include "roslam/sensors/inertial_sample.hpp"
#include "simulation/simulated_flight.hpp"

namespace roslam::simulation {

/// The calibration of the simulated inertial measurement unit: x forward, y left, z up, beside the camera.
ImuCalibration simulated_imu();

/// The bias of its gyroscope, rad/s: a constant of the seed and a slow change.
Eigen::Vector3d gyroscope_bias(double time, std::uint32_t seed);

/// Its samples at 200 Hz after the first and up to the second time (seconds), with bias and white noise as a
/// consumer unit has them. A sample is a function of flight, time and seed alone.
std::vector<InertialSample> inertial_samples(const Flight& flight, double after, double until,
                                             std::uint32_t seed);

}  // namespace roslam::simulation
