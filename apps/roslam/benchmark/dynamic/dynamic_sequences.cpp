// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/dynamic/dynamic_sequences.hpp"

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/roslam/benchmark/dynamic/paper_tables.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

constexpr auto kCounterpartSuffix = "-still";

// An image list of a composed folder, with absolute paths.
std::string with_absolute_paths(const fs::path& list) {
  std::ifstream stream(list);
  if (!stream) throw InputError(list.string() + ": cannot be read; compose the sequence again");
  std::string text;
  for (std::string line; std::getline(stream, line);) {
    const auto space = line.find(' ');
    if (line.empty() || line.front() == '#' || space == std::string::npos) continue;
    const fs::path file = list.parent_path() / line.substr(space + 1);
    text += line.substr(0, space) + " " + fs::absolute(file).lexically_normal().string() + "\n";
  }
  return text;
}

// The depth images of the recording a sequence was composed from have units of their own.
Camera camera_of_base(const BenchmarkSequence& composed) {
  const fs::path file = fs::path(composed.source) / "composition.json";
  Camera camera = load_camera(composed.camera);
  try {
    const auto json = nlohmann::json::parse(std::ifstream(file));
    camera.depth_units_per_metre = json.at("background_depth_units_per_metre").get<double>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file.string() + ": is not as `roslam compose` writes it (" + error.what() +
                     "); compose the sequence again");
  }
  return camera;
}

BenchmarkSequence counterpart_of_composed(const BenchmarkSequence& composed, const fs::path& out) {
  const fs::path folder = composed.source;
  const fs::path counterpart = out / "counterparts" / composed.name;
  make_folder(counterpart);
  write_file(counterpart / "rgb.txt", with_absolute_paths(folder / "background.txt"));
  write_file(counterpart / "depth.txt", with_absolute_paths(folder / "background_depth.txt"));
  write_file(counterpart / "camera.yaml", camera_to_yaml(camera_of_base(composed)));
  return {composed.name + kCounterpartSuffix, counterpart.string(), (counterpart / "camera.yaml").string(),
          composed.truth};
}

std::optional<BenchmarkSequence> counterpart_of(const BenchmarkSequence& sequence, bool has_traffic,
                                                const fs::path& out) {
  if (sequence.is_simulated()) {
    if (!has_traffic) return std::nullopt;
    BenchmarkSequence counterpart = sequence;
    counterpart.name += kCounterpartSuffix;
    return counterpart;
  }
  const fs::path folder = sequence.source;
  if (!fs::exists(folder / "background.txt") || !fs::exists(folder / "background_depth.txt")) return {};
  return counterpart_of_composed(sequence, out);
}

BenchmarkSequence named_counterpart(const std::string& argument, const BenchmarkSequence& sequence,
                                    const std::string& camera) {
  BenchmarkSequence counterpart = find_sequences({argument}, camera).front();
  if (counterpart.is_simulated()) {
    throw InputError("--counterparts " + argument +
                     ": the counterpart of a simulated flight is the flight without traffic; name a folder");
  }
  counterpart.name = sequence.name + kCounterpartSuffix;
  return counterpart;
}

// Results with the same name would overwrite each other.
void require_unique_names(const std::vector<DynamicSequence>& pairs) {
  std::set<std::string> taken{"bars"};
  const auto take = [&](const std::string& name) {
    if (!taken.insert(name).second) {
      throw InputError("--sequences: two results would be called '" + name +
                       "'; rename a folder, or run them one after the other");
    }
  };
  for (const auto& pair : pairs) {
    take(pair.sequence.name);
    if (pair.counterpart) take(pair.counterpart->name);
  }
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::string> sequences_of_table_3(const fs::path& tum) {
  std::vector<std::string> found;
  for (const auto& row : paper_table_3()) {
    const fs::path folder = tum / tum_folder_of(row);
    if (fs::is_directory(folder)) found.push_back(folder.string() + ":tum-fr3");
  }
  if (found.empty()) {
    throw InputError("--tum " + tum.string() + ": holds none of the sequences of table 3, such as " +
                     tum_folder_of(paper_table_3().front()) + "; scripts/get_tum downloads them");
  }
  return found;
}
}  // namespace

bool has_same_frames(const BenchmarkSequence& a, const BenchmarkSequence& b) {
  if (a.source == b.source && a.camera == b.camera) return true;
  const fs::path one = a.source;
  const fs::path other = b.source;
  return text_of(one / "rgb.txt") == text_of(other / "rgb.txt") &&
         text_of(one / "depth.txt") == text_of(other / "depth.txt") &&
         camera_to_yaml(load_camera(a.camera)) == camera_to_yaml(load_camera(b.camera));
}

std::vector<DynamicSequence> find_dynamic_sequences(const DynamicSequenceArguments& arguments,
                                                    const fs::path& out) {
  std::vector<std::string> names;
  if (!arguments.tum.empty()) names = sequences_of_table_3(arguments.tum);
  const std::size_t of_tum = names.size();
  names.insert(names.end(), arguments.sequences.begin(), arguments.sequences.end());
  if (!arguments.counterparts.empty() && arguments.counterparts.size() != arguments.sequences.size()) {
    throw InputError("--counterparts: " + std::to_string(arguments.counterparts.size()) + " for " +
                     std::to_string(arguments.sequences.size()) +
                     " --sequences; give one each, - for the default");
  }
  std::vector<DynamicSequence> result;
  for (auto& sequence : find_sequences(names, arguments.camera)) {
    const std::size_t index = result.size();
    const bool is_named =
        index >= of_tum && !arguments.counterparts.empty() && arguments.counterparts[index - of_tum] != "-";
    auto counterpart =
        is_named ? named_counterpart(arguments.counterparts[index - of_tum], sequence, arguments.camera)
                 : counterpart_of(sequence, arguments.has_traffic, out);
    result.push_back({std::move(sequence), std::move(counterpart)});
  }
  require_unique_names(result);
  return result;
}

}  // namespace roslam::app
