// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/benchmark_sequences.hpp"

namespace roslam::app {

/// A sequence in which things move, and the same frames without them where there are any.
struct DynamicSequence {
  BenchmarkSequence sequence;
  std::optional<BenchmarkSequence> twin;
};

/// What the command line names.
struct DynamicSequenceArguments {
  std::vector<std::string> sequences;  ///< as find_sequences() takes them
  std::vector<std::string> twins;      ///< one a sequence; "-", or none at all, = what can be found
  std::string camera;                  ///< of the folders that name none
  std::string tum;                     ///< folder with sequences as scripts/get_tum leaves them; may be empty
  bool has_traffic = true;             ///< of simulated flights; one without is no twin to itself
};

/// Whether two recordings list the same images of the same camera.
bool has_same_frames(const BenchmarkSequence& a, const BenchmarkSequence& b);

/// The sequences with their twins: a simulated flight has itself without traffic; what `roslam compose` wrote
/// has the frames it was made of, for which a folder of lists is written to out/twins. Those of table 3 of
/// the paper that lie in the TUM folder come first, in its order. Throws InputError, CalibrationError or
/// OutputError.
std::vector<DynamicSequence> find_dynamic_sequences(const DynamicSequenceArguments& arguments,
                                                    const std::filesystem::path& out);

}  // namespace roslam::app
