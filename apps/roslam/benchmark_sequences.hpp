// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

/// One input of a benchmark, found to be usable.
struct BenchmarkSequence {
  std::string name;    ///< short, differs from those of the others, fit for a file's name
  std::string source;  ///< a folder or simulated:...
  std::string camera;  ///< a preset or a file; empty for a simulation
  Trajectory truth;    ///< empty if none is known before the run

  bool is_simulated() const;
};

/// Understands FOLDER, FOLDER:CAMERA and simulated:FLIGHT. A folder without a camera takes fallback_camera,
/// or the camera.yaml inside it if that is empty. Reads the truth from the folder's groundtruth.txt. Throws
/// InputError or CalibrationError for what could not be run: before hours are spent on the sequences before
/// it.
std::vector<BenchmarkSequence> find_sequences(const std::vector<std::string>& arguments,
                                              const std::string& fallback_camera);

}  // namespace roslam::app
