// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "apps/roslam/evaluate/map_sequence.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "evaluation/map_error.hpp"

namespace roslam::app {

struct MapEvaluationSettings {
  MapSequenceSettings truth;
  std::vector<NamedPath> estimates;  ///< run folders with dense.ply and trajectory.txt, or PLY files beside a
                                     ///< trajectory.txt
  std::filesystem::path reference;   ///< the same, of the reference map; empty: none
  std::size_t every = 5;             ///< every so many-th frame of the truth is used
  evaluation::MapTruthOptions truth_options;
  evaluation::MapErrorOptions error_options;
  bool quiet = false;
};

/// Compares the dense maps of runs with the static scene, after SE(3) alignment of their trajectories with
/// the truth. A truth that is a PLY file is in the world frame of the maps and has no camera. Throws
/// InputError for what is missing or does not fit, CalibrationError and OptionsError.
std::vector<evaluation::EvaluatedMap> evaluate_maps(const MapEvaluationSettings& settings);

}  // namespace roslam::app
