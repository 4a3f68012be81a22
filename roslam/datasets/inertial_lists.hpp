// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "roslam/sensors/counts.hpp"
#include "roslam/sensors/inertial_sample.hpp"

namespace roslam::datasets {

/// Samples of a gyroscope and an accelerometer that are listed apart: lines "time x y z" (rad/s, m/s^2).
/// seconds: the unit of the times. A sample is one of the gyroscope with the acceleration interpolated at its
/// time; those before the first or after the last of the accelerometer are left out. Lines that are no sample
/// and what is left out is counted in notes. Throws InputError as for_each_line does.
std::vector<InertialSample> read_inertial_lists(const std::filesystem::path& gyroscope,
                                                const std::filesystem::path& accelerometer, double seconds,
                                                Counts& notes);

/// Samples of a table: lines "time wx wy wz ax ay az", separated by commas.
std::vector<InertialSample> read_inertial_table(const std::filesystem::path& file, double seconds,
                                                Counts& notes);

}  // namespace roslam::datasets
