// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// What an inertial measurement unit (IMU) measures at one time, in its own frame.
struct ROSLAM_EXPORT InertialSample {
  double timestamp = 0.0;                               ///< seconds, on the clock of the frames
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();  ///< of the gyroscope, rad/s
  Eigen::Vector3d acceleration =
      Eigen::Vector3d::Zero();  ///< of the accelerometer, m/s^2: at rest it points up
};

/// What is known of a gyroscope by the images so far.
struct ROSLAM_EXPORT GyroscopeState {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();        ///< rad/s, in the frame of the IMU
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Zero();  ///< rad/s
  bool agrees = true;       ///< false while most rotations by the images contradict it
  std::size_t samples = 0;  ///< used
  std::size_t skipped = 0;  ///< not finite, impossible, or not in the order of time
};

/// The samples of a text file, in order of time.
struct InertialFile {
  std::vector<InertialSample> samples;
  std::size_t skipped = 0;  ///< lines that are not seven finite numbers, or whose time is that of another
};

/// Reads lines "timestamp wx wy wz ax ay az" (seconds, rad/s, m/s^2); # begins a comment. Throws InputError
/// if the file cannot be opened or holds no sample.
ROSLAM_EXPORT InertialFile read_inertial_file(const std::filesystem::path& file);

/// Puts samples of a frame that is passed over before those of the next. Keeps the newest if they are many.
inline void prepend_samples(std::vector<InertialSample> earlier, std::vector<InertialSample>& samples) {
  constexpr std::size_t kMost = 4000;  // some seconds of the fastest units
  earlier.insert(earlier.end(), samples.begin(), samples.end());
  if (earlier.size() > kMost)
    earlier.erase(earlier.begin(), earlier.end() - static_cast<std::ptrdiff_t>(kMost));
  samples = std::move(earlier);
}

}  // namespace roslam
