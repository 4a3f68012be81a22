// SPDX-License-Identifier: BSD-3-Clause
#include "recording/recorded_removal.hpp"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "recording/removal_record.hpp"
#include "roslam/common/error.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::json;

Options read_options_of_run(const fs::path& file) {
  std::ifstream in(file);
  if (!in || fs::is_directory(file)) {
    throw InputError(file.string() + ": cannot open it; give the folder that roslam run wrote with --out");
  }
  const Json json = Json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("options")) {
    throw InputError(file.string() + ": holds no options of a run, it is damaged; repeat the run");
  }
  try {
    return options_from_json(json["options"].dump());
  } catch (const OptionsError& error) {
    throw InputError(file.string() + ": " + error.what() + "; repeat the run");
  }
}

// Throws Json::exception if it is not a non-negative integer.
std::size_t count_from(const Json& value) { return value.get_ref<const Json::number_unsigned_t&>(); }

// A pixel coordinate. Throws Json::exception if it is out of range.
int pixels_from(const Json& value) {
  constexpr double kMost = 1e6;
  const double number = value.get<double>();
  return std::abs(number) <= kMost ? static_cast<int>(number) : Json().get<int>();  // which throws
}

RemovedRegion region_from(const Json& object) {
  const Json& box = object.at("box");
  const auto kind = movable_from(object.at("class").get_ref<const std::string&>());
  return {kind.value_or(Movable::kUnknown), square_around({pixels_from(box.at(0)), pixels_from(box.at(1)),
                                                           pixels_from(box.at(2)), pixels_from(box.at(3))})};
}

struct Line {
  double timestamp = 0.0;
  RecordedFrame frame;
};

// Throws Json::exception for a line that descriptor_line() cannot have written.
Line parse(const std::string& text, const fs::path& folder) {
  const Json json = Json::parse(text);
  Line line;
  json.at("timestamp").get_to(line.timestamp);
  if (const Json& mask = json.at("mask"); !mask.is_null()) line.frame.mask = folder / mask.get<std::string>();
  evaluation::CountedPoints& points = line.frame.points;
  points.kept = count_from(json.at("kept_points"));
  for (const auto& [kind, count] : json.at("removed_points").items()) {
    points.removed += count_from(count);
    if (kind == kBesideMask) points.beside = count_from(count);
  }
  std::set<std::size_t> moving;
  for (const auto& object : json.at("objects")) {
    const bool rests = object.at("at_rest").get<bool>();
    (rests ? line.frame.resting : moving).insert(count_from(object.at("value")));
    line.frame.regions.push_back(region_from(object));
    line.frame.has_objects = true;
  }
  for (const std::size_t value : moving)
    line.frame.resting.erase(value);  // objects beyond the last value share it
  return line;
}
}  // namespace

RecordedRemoval::RecordedRemoval(const fs::path& run_folder)
    : folder_(run_folder), options_(read_options_of_run(run_folder / "run.json")) {
  if (!has_frames()) return;
  const fs::path file = folder_ / kDescriptorFile;
  std::ifstream in(file);
  if (!in || fs::is_directory(file)) {
    throw InputError(file.string() +
                     ": cannot open it, though the run removed dynamic objects; repeat the run with --out");
  }
  std::string text;
  for (std::size_t number = 1; std::getline(in, text); ++number) {
    try {
      Line line = parse(text, folder_);
      frames_.insert_or_assign(mask_name(line.timestamp), std::move(line.frame));
    } catch (const Json::exception&) {
      throw InputError(file.string() + ":" + std::to_string(number) +
                       ": is not a record of the objects removed from a frame; repeat the run");
    }
  }
}

const RecordedFrame* RecordedRemoval::find(double timestamp) const {
  const auto found = frames_.find(mask_name(timestamp));
  return found == frames_.end() ? nullptr : &found->second;
}

}  // namespace roslam::recording
