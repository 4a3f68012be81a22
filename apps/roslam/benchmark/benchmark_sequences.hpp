// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

/// One input of a benchmark, checked to be usable.
struct BenchmarkSequence {
  std::string name;    ///< short, unique, usable as a file name
  std::string source;  ///< a folder or simulated:...
  std::string camera;  ///< a preset or a file; empty for a simulation
  Trajectory truth;    ///< T_world_camera; empty if not known before the run

  bool is_simulated() const;
};

/// Parses FOLDER, FOLDER:CAMERA and simulated:FLIGHT. A folder without a camera gets fallback_camera, or the
/// camera.yaml inside it if that is empty. Reads the truth from the folder's groundtruth.txt. Throws
/// InputError or CalibrationError for a sequence that cannot be run, before any sequence is.
std::vector<BenchmarkSequence> find_sequences(const std::vector<std::string>& arguments,
                                              const std::string& fallback_camera);

}  // namespace roslam::app
