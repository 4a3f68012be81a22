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

#include "roslam/geometry/trajectory.hpp"
#include "roslam/sources/composer.hpp"
#include "roslam/sources/tum_source.hpp"

namespace roslam::app {

/// From where to where a sequence is composed.
struct CompositionSettings {
  std::filesystem::path folder;           ///< the sequence without people, in the TUM format
  std::filesystem::path out;              ///< the folder to write to
  double depth_units_per_metre = 5000.0;  ///< of the depth images written
  std::size_t frames = 0;                 ///< how many to write; 0 = all
  bool quiet = false;                     ///< no progress
};

/// What was written, and why frames were not.
struct Composition {
  std::vector<double> times;                   ///< of the frames, seconds
  std::vector<double> covered;                 ///< share of each picture that shows actors
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

/// True poses from the first image to the last: what the camera did before and after says nothing about where
/// people can be seen. Throws InputError if there are none.
Trajectory read_truth(const std::filesystem::path& folder);

/// Which way is up in the world, from depth images spread over the sequence; nothing if they do not tell.
std::optional<Eigen::Vector3d> find_up(const std::filesystem::path& folder, const Camera& camera,
                                       const Trajectory& truth);

/// Throws OutputError if the output would replace images or lists of the sequence.
void protect_base(const CompositionSettings& settings);

/// Writes images, lists and poses until the source ends or a stop is asked for; lists and poses then hold
/// what was written so far. Throws OutputError.
Composition write_composition(const CompositionSettings& settings, const Composer& composer,
                              TumSource& source, const Trajectory& truth, const std::stop_token& stop);

}  // namespace roslam::app
