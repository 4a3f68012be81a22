// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "simulation/composition/composer.hpp"

namespace roslam::app {

/// Input and output of a composition.
struct CompositionSettings {
  std::filesystem::path folder;           ///< the sequence without people, in the TUM format
  std::filesystem::path out;              ///< the folder to write to
  double depth_units_per_metre = 5000.0;  ///< of the depth images written
  std::size_t frames = 0;                 ///< number to write; 0 = all
  bool quiet = false;                     ///< no progress
};

/// The frames that were written, and the reasons why others were not.
struct Composition {
  std::vector<double> times;                   ///< of the frames, seconds
  std::vector<double> covered;                 ///< share of each image that shows actors
  std::map<std::string, std::size_t> skipped;  ///< frames and depth images, by reason
  std::size_t too_far = 0;                     ///< pixels whose depth does not fit into 16 bits
  bool interrupted = false;

  double mean() const {
    double sum = 0.0;
    for (const double share : covered) sum += share;
    return covered.empty() ? 0.0 : sum / static_cast<double>(covered.size());
  }
  double most() const { return covered.empty() ? 0.0 : *std::max_element(covered.begin(), covered.end()); }
};

/// True poses T_world_camera from the first image to the last; people are placed only where these see them.
/// Throws InputError if there are none.
Trajectory read_truth(const std::filesystem::path& folder);

/// Up direction (unit vector, world frame), from depth images spread over the sequence; nothing if they show
/// no level surface.
std::optional<Eigen::Vector3d> find_up(const std::filesystem::path& folder, const Camera& camera,
                                       const Trajectory& truth);

/// Throws OutputError if the output would replace images or lists of the sequence.
void protect_base(const CompositionSettings& settings);

/// Writes images, lists and poses until the source ends or a stop is asked for; lists and poses then hold
/// what was written so far. Throws OutputError.
Composition write_composition(const CompositionSettings& settings, const simulation::Composer& composer,
                              TumSource& source, const Trajectory& truth, const std::stop_token& stop);

}  // namespace roslam::app
