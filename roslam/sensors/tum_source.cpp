// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/tum_source.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string_view>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam {

namespace {
struct List {
  std::vector<TimedFile> entries;
  std::size_t without_time = 0;  // lines whose time is not a number
};

// Excerpt of a line for an error message: short and without control characters.
std::string excerpt(const std::string& line) {
  constexpr std::size_t kLength = 60;
  std::string shown = line.substr(0, kLength);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; },
      '?');
  return line.size() > kLength ? shown + "..." : shown;
}

// std::from_chars, unlike streams, does not depend on the locale and reads "nan" and "inf".
std::optional<double> parse_time(const std::string& word) {
  double time = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), time);
  if (end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  return error == std::errc() ? std::make_optional(time) : std::nullopt;
}

List read_list(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in || std::filesystem::is_directory(file)) {
    throw InputError(file.string() +
                     ": cannot open it; a TUM RGB-D folder holds rgb.txt, depth.txt and the images "
                     "they name");
  }
  List list;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // some editors put it before the first line
    if (number == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    std::istringstream fields(line);
    std::string time_word;
    std::string image;
    fields >> time_word >> image;
    if (time_word.empty() || time_word.front() == '#') continue;
    const auto time = parse_time(time_word);
    if (!time || image.empty()) {
      throw InputError(file.string() + ":" + std::to_string(number) + ": expected 'timestamp file', got '" +
                       excerpt(line) + "'; correct or remove the line");
    }
    if (std::isfinite(*time)) {
      list.entries.push_back({*time, image});
    } else {
      ++list.without_time;
    }
  }
  if (list.entries.empty()) throw InputError(file.string() + ": names no image; is the dataset complete?");
  return list;
}

// Drops the fewest entries that make the times strictly increasing and returns how many. A greedy filter
// would lose every entry after a single time far in the future.
std::size_t drop_out_of_order(std::vector<TimedFile>& entries) {
  // Longest increasing subsequence: last_of[n] is the last entry of the one of length n + 1 ending earliest.
  std::vector<std::size_t> last_of;
  std::vector<std::size_t> before(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto at = std::lower_bound(last_of.begin(), last_of.end(), entries[i].timestamp,
                                     [&](std::size_t e, double time) { return entries[e].timestamp < time; });
    if (at != last_of.begin()) before[i] = *std::prev(at);
    if (at == last_of.end()) {
      last_of.push_back(i);
    } else if (entries[*at].timestamp > entries[i].timestamp) {  // of equal times the first is kept
      *at = i;
    }
  }
  std::vector<TimedFile> kept(last_of.size());
  for (std::size_t n = kept.size(), i = last_of.back(); n > 0; i = before[i]) kept[--n] = entries[i];
  const std::size_t dropped = entries.size() - kept.size();
  entries = std::move(kept);
  return dropped;
}

std::string size_in_words(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

void count(std::map<std::string, std::size_t>& counts, const char* reason, std::size_t number) {
  if (number > 0) counts[reason] += number;
}
}  // namespace

void TumOptions::validate() const {
  if (!(max_time_difference >= 0.0 && max_time_difference < 10.0)) {
    throw OptionsError("max_time_difference must be 0 to 10 seconds, got " +
                       std::to_string(max_time_difference));
  }
}

std::vector<TimedFile> read_tum_list(const std::filesystem::path& file) { return read_list(file).entries; }

std::vector<int> associate_by_time(const std::vector<TimedFile>& colour, const std::vector<TimedFile>& depth,
                           double max_time_difference) {
  struct Pair {
    double difference;
    std::size_t colour;
    std::size_t depth;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    const auto first = std::lower_bound(depth.begin(), depth.end(), colour[i].timestamp - max_time_difference,
                                        [](const TimedFile& d, double time) { return d.timestamp < time; });
    for (auto it = first; it != depth.end() && it->timestamp <= colour[i].timestamp + max_time_difference;
         ++it) {
      pairs.push_back(
          {std::abs(it->timestamp - colour[i].timestamp), i, static_cast<std::size_t>(it - depth.begin())});
    }
  }
  // Closest pairs first, so that each image is paired with its best partner.
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.difference < b.difference; });
  std::vector<int> result(colour.size(), -1);
  std::vector<bool> used(depth.size(), false);
  for (const auto& pair : pairs) {
    if (result[pair.colour] >= 0 || used[pair.depth]) continue;
    result[pair.colour] = static_cast<int>(pair.depth);
    used[pair.depth] = true;
  }
  return result;
}

std::optional<std::filesystem::path> TumSource::depth_file(std::size_t index) const {
  if (depth_of_colour_[index] < 0) return std::nullopt;
  return folder_ / depth_[static_cast<std::size_t>(depth_of_colour_[index])].file;
}

bool TumSource::recognises(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "rgb.txt");
}

TumSource::TumSource(const std::filesystem::path& folder, const Camera& camera, const TumOptions& options)
    : folder_(folder), camera_(camera) {
  options.validate();
  camera.validate();
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(folder.string() + ": no such folder; give a TUM RGB-D dataset or simulated:street");
  }
  List colour = read_list(folder / "rgb.txt");
  List depth = read_list(folder / "depth.txt");
  size_ = colour.entries.size() + colour.without_time;
  count(skipped_, "colour image without a time", colour.without_time);
  count(skipped_, "colour image out of the order of time", drop_out_of_order(colour.entries));
  count(skipped_depth_, "depth image without a time", depth.without_time);
  count(skipped_depth_, "depth image out of the order of time", drop_out_of_order(depth.entries));
  colour_ = std::move(colour.entries);
  depth_ = std::move(depth.entries);
  depth_of_colour_ = associate_by_time(colour_, depth_, options.max_time_difference);
}

std::optional<Frame> TumSource::next() {
  while (position_ < colour_.size()) {
    if (auto frame = read(position_++)) return frame;
  }
  return std::nullopt;
}

std::optional<Frame> TumSource::read(std::size_t index) {
  const ImageFile colour = read_colour_image(folder_ / colour_[index].file);
  if (!colour.error.empty()) {
    ++skipped_["colour image " + colour.error];
    return std::nullopt;
  }
  const cv::Size expected(camera_.width, camera_.height);
  if (colour.image.size() != expected) {
    ++skipped_["colour image is " + size_in_words(colour.image.size()) + " but the camera " +
               size_in_words(expected) + " pixels"];
    return std::nullopt;
  }
  Frame frame;
  frame.index = index;
  frame.timestamp = colour_[index].timestamp;
  frame.colour = colour.image;
  frame.depth = read_depth_for(index, colour.image.size());
  return frame;
}

cv::Mat TumSource::read_depth_for(std::size_t index, const cv::Size& colour_size) {
  if (depth_of_colour_[index] < 0) {
    ++skipped_depth_["no depth image near in time"];
    return {};
  }
  const auto& entry = depth_[static_cast<std::size_t>(depth_of_colour_[index])];
  const ImageFile depth = read_depth_image(folder_ / entry.file);
  if (!depth.error.empty()) {
    ++skipped_depth_["depth image " + depth.error];
    return {};
  }
  if (depth.image.size() != colour_size) {
    ++skipped_depth_["depth image is " + size_in_words(depth.image.size()) + " but the colour image " +
                     size_in_words(colour_size) + " pixels"];
    return {};
  }
  return depth_to_metres(depth.image, camera_.depth_units_per_metre);
}

}  // namespace roslam
