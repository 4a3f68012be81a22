// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/dynamic_sequences.hpp"

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/roslam/paper_tables.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

constexpr auto kTwinSuffix = "-still";

// A list of images of a composed folder with paths that hold from anywhere.
std::string list_from_anywhere(const fs::path& list) {
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

// The depth images of the frames beneath a composed sequence have units of their own.
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

BenchmarkSequence twin_of_composed(const BenchmarkSequence& composed, const fs::path& out) {
  const fs::path folder = composed.source;
  const fs::path twin = out / "twins" / composed.name;
  make_folder(twin);
  write_file(twin / "rgb.txt", list_from_anywhere(folder / "background.txt"));
  write_file(twin / "depth.txt", list_from_anywhere(folder / "background_depth.txt"));
  write_file(twin / "camera.yaml", camera_to_yaml(camera_of_base(composed)));
  return {composed.name + kTwinSuffix, twin.string(), (twin / "camera.yaml").string(), composed.truth};
}

std::optional<BenchmarkSequence> twin_of(const BenchmarkSequence& sequence, bool has_traffic,
                                         const fs::path& out) {
  if (sequence.is_simulated()) {
    if (!has_traffic) return std::nullopt;
    BenchmarkSequence twin = sequence;
    twin.name += kTwinSuffix;
    return twin;
  }
  const fs::path folder = sequence.source;
  if (!fs::exists(folder / "background.txt") || !fs::exists(folder / "background_depth.txt")) return {};
  return twin_of_composed(sequence, out);
}

BenchmarkSequence named_twin(const std::string& argument, const BenchmarkSequence& sequence,
                             const std::string& camera) {
  BenchmarkSequence twin = find_sequences({argument}, camera).front();
  if (twin.is_simulated()) {
    throw InputError("--twins " + argument +
                     ": a simulated flight is its own twin without traffic; name a "
                     "folder");
  }
  twin.name = sequence.name + kTwinSuffix;
  return twin;
}

// Results that share a name would overwrite each other.
void require_names_differ(const std::vector<DynamicSequence>& pairs) {
  std::set<std::string> taken{"bars"};
  const auto take = [&](const std::string& name) {
    if (!taken.insert(name).second) {
      throw InputError("--sequences: two results would be called '" + name +
                       "'; rename a folder, or run them one after the other");
    }
  };
  for (const auto& pair : pairs) {
    take(pair.sequence.name);
    if (pair.twin) take(pair.twin->name);
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
  if (!arguments.twins.empty() && arguments.twins.size() != arguments.sequences.size()) {
    throw InputError("--twins: " + std::to_string(arguments.twins.size()) + " for " +
                     std::to_string(arguments.sequences.size()) +
                     " --sequences; give one each, - for none of your own");
  }
  std::vector<DynamicSequence> result;
  for (auto& sequence : find_sequences(names, arguments.camera)) {
    const std::size_t index = result.size();
    const bool is_named =
        index >= of_tum && !arguments.twins.empty() && arguments.twins[index - of_tum] != "-";
    auto twin = is_named ? named_twin(arguments.twins[index - of_tum], sequence, arguments.camera)
                         : twin_of(sequence, arguments.has_traffic, out);
    result.push_back({std::move(sequence), std::move(twin)});
  }
  require_names_differ(result);
  return result;
}

}  // namespace roslam::app
