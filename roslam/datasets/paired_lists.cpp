// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/paired_lists.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::datasets {

namespace {
namespace fs = std::filesystem;

struct Pair {
  double times[2];
  fs::path files[2];
};

bool says_depth(const fs::path& file) { return file.string().find("depth") != std::string::npos; }

// The column of the depth images: 0 or 1.
std::size_t depth_column(const fs::path& folder, const std::vector<Pair>& pairs) {
  const Pair& first = pairs.front();
  if (says_depth(first.files[0]) != says_depth(first.files[1])) return says_depth(first.files[0]) ? 0 : 1;
  constexpr std::size_t kTried = 20;
  for (std::size_t i = 0; i < std::min(pairs.size(), kTried); ++i) {
    for (const std::size_t column : {0U, 1U}) {
      if (read_depth_image(folder / pairs[i].files[column]).error.empty()) return column;
    }
  }
  return 1;
}
}  // namespace

std::optional<fs::path> find_paired_list(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"associations.txt", "associated.txt"}) {
    if (fs::is_regular_file(folder / name, error)) return folder / name;
  }
  std::vector<fs::path> found;
  fs::directory_iterator entries(folder, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    if (name.starts_with("assoc") && name.ends_with(".txt")) found.push_back(entries->path());
  }
  if (found.empty()) return std::nullopt;
  return *std::min_element(found.begin(), found.end());
}

PairedList read_paired_list(const fs::path& list) {
  std::vector<Pair> pairs;
  PairedList result{list, {}, {}};
  for_each_line(list, "is the dataset complete?", [&](std::size_t number, std::string_view line) {
    const auto words = words_of(line);
    const auto first = words.size() == 4 ? number_from(words[0]) : std::nullopt;
    const auto second = words.size() == 4 ? number_from(words[2]) : std::nullopt;
    if (!first || !second) {
      throw InputError(list.string() + ":" + std::to_string(number) +
                       ": expected 'timestamp file timestamp file'; correct or remove the line");
    }
    if (std::isfinite(*first) && std::isfinite(*second)) {
      pairs.push_back({{*first, *second}, {words[1], words[3]}});
    } else {
      ++result.colour.without_time;
    }
  });
  if (pairs.empty()) throw InputError(list.string() + ": names no image; is the dataset complete?");
  const std::size_t depth = depth_column(list.parent_path(), pairs);
  for (const Pair& pair : pairs) {
    result.colour.entries.push_back({pair.times[1 - depth], pair.files[1 - depth]});
    result.depth.push_back(pair.files[depth]);
  }
  return result;
}

double list_pairs(PairedList pairs, FolderListing& listing) {
  const fs::path folder = pairs.list.parent_path();
  const std::string name = pairs.list.filename().string();
  std::map<fs::path, fs::path> depth_of;
  for (std::size_t i = 0; i < pairs.depth.size(); ++i)
    depth_of.try_emplace(pairs.colour.entries[i].file, pairs.depth[i]);
  const double seconds = convert_to_seconds({&pairs.colour}, listing.camera.fps, listing.notes).seconds;
  for (const TimedFile& entry :
       ordered_entries(name, "colour image", std::move(pairs.colour), listing.notes, listing.skipped)) {
    listing.frames.push_back({entry.timestamp,
                              entry.segment,
                              folder / entry.file,
                              folder / depth_of.at(entry.file),
                              {},
                              std::nullopt});
  }
  return seconds;
}

double list_by_time(const fs::path& colour_list, const fs::path& depth_list, double max_time_difference,
                    FolderListing& listing) {
  TimedFileList colour = read_timed_files(colour_list);
  TimedFileList depth = read_timed_files(depth_list);
  const double seconds = convert_to_seconds({&colour, &depth}, listing.camera.fps, listing.notes).seconds;
  const auto colours = ordered_entries(colour_list.filename().string(), "colour image", std::move(colour),
                                       listing.notes, listing.skipped);
  const auto depths = ordered_entries(depth_list.filename().string(), "depth image", std::move(depth),
                                      listing.notes, listing.skipped_depth);
  if (colours.back().segment > 0 || depths.back().segment > 0) {
    throw InputError(colour_list.parent_path().string() +
                     ": the clock restarts in its lists; split the recording where it restarts");
  }
  const auto pairs = associate_by_time(colours, depths, max_time_difference);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    ListedFrame frame{colours[i].timestamp, 0, colour_list.parent_path() / colours[i].file, {}, {}, {}};
    if (pairs[i] >= 0)
      frame.depth = depth_list.parent_path() / depths[static_cast<std::size_t>(pairs[i])].file;
    listing.frames.push_back(std::move(frame));
  }
  return seconds;
}

}  // namespace roslam::datasets
