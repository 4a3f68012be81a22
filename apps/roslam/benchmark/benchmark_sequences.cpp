// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_sequences.hpp"

#include <filesystem>
#include <set>
#include <string_view>

#include "apps/roslam/support/sources.hpp"
#include "roslam/common/error.hpp"
#include "simulation/simulated_options.hpp"

namespace roslam::app {

using namespace simulation;

namespace {
namespace fs = std::filesystem;
constexpr std::string_view kSimulated = "simulated:";

BenchmarkSequence simulated(const std::string& argument) {
  const std::string flight = argument.substr(kSimulated.size());
  if (!flight_path_from(flight)) {
    throw InputError(argument + ": no such flight; use simulated:street, :loop, :hover, :turn or :corridor");
  }
  return {"simulated-" + flight, argument, "", {}};
}

// The last component of a path, also of one that ends in a slash or is ".".
std::string folder_name(const fs::path& given) {
  const fs::path path = fs::absolute(given).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

BenchmarkSequence recorded(const std::string& argument, const std::string& fallback_camera) {
  BenchmarkSequence sequence{"", argument, fallback_camera, {}};
  const auto colon = argument.rfind(':');
  // An existing folder whose name contains a colon takes precedence.
  if (colon != std::string::npos && !fs::is_directory(argument)) {
    sequence.source = argument.substr(0, colon);
    sequence.camera = argument.substr(colon + 1);
  }
  const fs::path folder = sequence.source;
  if (!fs::is_directory(folder)) {
    throw InputError(argument + ": no such folder; give FOLDER, FOLDER:CAMERA or simulated:street");
  }
  if (sequence.camera.empty() && fs::exists(folder / "camera.yaml"))
    sequence.camera = (folder / "camera.yaml").string();
  if (sequence.camera.empty() && !is_other_dataset(sequence.source)) {
    throw InputError(argument + ": needs a camera: FOLDER:CAMERA, --camera or a camera.yaml in the folder");
  }
  open_source({sequence.source, sequence.camera});
  if (fs::exists(folder / "groundtruth.txt"))
    sequence.truth = read_trajectory(folder / "groundtruth.txt").trajectory;
  sequence.name = folder_name(folder);
  return sequence;
}

// Results of sequences with the same name would overwrite each other: the later ones are numbered.
void make_names_unique(std::vector<BenchmarkSequence>& sequences) {
  std::set<std::string> taken;
  for (auto& sequence : sequences) {
    const std::string wanted = sequence.name;
    for (int number = 2; !taken.insert(sequence.name).second; ++number) {
      sequence.name = wanted + "_" + std::to_string(number);
    }
  }
}
}  // namespace

bool BenchmarkSequence::is_simulated() const { return source.starts_with(kSimulated); }

std::vector<BenchmarkSequence> find_sequences(const std::vector<std::string>& arguments,
                                              const std::string& fallback_camera) {
  std::vector<BenchmarkSequence> sequences;
  for (const auto& argument : arguments) {
    sequences.push_back(argument.starts_with(kSimulated) ? simulated(argument)
                                                         : recorded(argument, fallback_camera));
  }
  make_names_unique(sequences);
  return sequences;
}

}  // namespace roslam::app
