// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_sequences.hpp"

namespace roslam::app {

/// A dynamic sequence and its static counterpart, the same frames without dynamic objects, if it has one.
struct DynamicSequence {
  BenchmarkSequence sequence;
  std::optional<BenchmarkSequence> counterpart;
};

/// Command line arguments.
struct DynamicSequenceArguments {
  std::vector<std::string> sequences;     ///< as for find_sequences()
  std::vector<std::string> counterparts;  ///< one per sequence, or none; "-" = the default
  std::string camera;                     ///< of folders given without one
  std::string tum;                        ///< folder filled by scripts/get_tum; may be empty
  bool has_traffic = true;                ///< simulated flights have traffic, so that they have a counterpart
};

/// Whether two recordings list the same images of the same camera.
bool has_same_frames(const BenchmarkSequence& a, const BenchmarkSequence& b);

/// The sequences with their static counterparts: of a simulated flight the one without traffic; of a folder
/// of `roslam compose` the frames it was composed from, whose image lists are written to out/counterparts.
/// Sequences of table 3 of the paper in the TUM folder come first, in its order. Throws InputError,
/// CalibrationError or OutputError.
std::vector<DynamicSequence> find_dynamic_sequences(const DynamicSequenceArguments& arguments,
                                                    const std::filesystem::path& out);

}  // namespace roslam::app
