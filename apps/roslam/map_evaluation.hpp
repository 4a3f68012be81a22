// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "apps/roslam/map_sequence.hpp"
#include "apps/roslam/named_path.hpp"
#include "roslam/evaluation/map_error.hpp"

namespace roslam::app {

struct MapEvaluationSettings {
  MapSequenceSettings truth;
  std::vector<NamedPath> estimates;  ///< run folders with dense.ply and trajectory.txt, or PLY files beside a
                                     ///< trajectory.txt
  std::filesystem::path reference;   ///< the same, of the map that could be had at best; empty: none
  std::size_t every = 5;             ///< of the truth's frames, one in so many is used
  MapTruthOptions truth_options;
  MapErrorOptions error_options;
  bool quiet = false;
};

/// Compares the dense maps of runs with what is static, put into the truth's world by their trajectories. A
/// truth that is a PLY file is in the same world as the maps and may have no camera.
/// Throws InputError for what is missing or does not fit, CalibrationError and OptionsError.
std::vector<EvaluatedMap> evaluate_maps(const MapEvaluationSettings& settings);

}  // namespace roslam::app
