// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/timed_files.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;
constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

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
std::optional<double> parse_time(std::string_view word) {
  double time = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), time);
  if (end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  return error == std::errc() ? std::make_optional(time) : std::nullopt;
}

std::string with_slashes(std::string text) {
  std::replace(text.begin(), text.end(), '\\', '/');
  return text;
}

// "my\ image.png" as shells write it.
std::string without_escapes(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    plain += text[i];
  }
  return plain;
}

// The file that the rest of a line names: of the ways to read it the first that exists in the folder.
fs::path file_named(const fs::path& folder, std::string_view rest) {
  std::string_view name = rest;
  std::string_view word = rest.substr(0, rest.find_first_of(kBlanks));  // further columns may follow
  if (const char quote = rest.front(); quote == '"' || quote == '\'') {
    if (const auto end = rest.find(quote, 1); end != std::string_view::npos && end > 1)
      name = word = rest.substr(1, end - 1);
  }
  std::error_code ignored;
  for (const std::string& candidate :
       {std::string(name), without_escapes(name), with_slashes(std::string(name)), std::string(word),
        with_slashes(std::string(word)), std::string(rest)}) {
    if (fs::exists(folder / candidate, ignored)) return candidate;
  }
  return name;
}

bool is_earlier(const TimedFile& a, const TimedFile& b) { return a.timestamp < b.timestamp; }

// The entries of the longest subsequence whose times strictly increase.
std::vector<bool> longest_increasing(const std::vector<TimedFile>& entries) {
  std::vector<std::size_t> last_of;  // last_of[n]: last entry of the one of length n + 1 that ends earliest
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
  std::vector<bool> is_in(entries.size(), false);
  if (last_of.empty()) return is_in;
  for (std::size_t n = last_of.size(), i = last_of.back(); n > 0; --n, i = before[i]) is_in[i] = true;
  return is_in;
}

// True if the clock restarts at an entry: the times before and after it increase, yet fall from one to the
// other.
bool restarts_at(const std::vector<TimedFile>& entries, std::size_t first) {
  constexpr std::size_t kWindow = 10;  // entries on each side
  constexpr std::size_t kLeast = 4;
  const std::size_t count = std::min({kWindow, first, entries.size() - first});
  if (count < kLeast || !is_earlier(entries[first], entries[first - 1])) return false;
  const auto increases = [&](std::size_t begin) {
    std::size_t rising = 0;
    for (std::size_t i = begin + 1; i < begin + count; ++i) rising += is_earlier(entries[i - 1], entries[i]);
    return rising + 1 + count / 5 >= count;
  };
  const auto median = [&](std::size_t begin) {
    std::vector<double> times;
    for (std::size_t i = begin; i < begin + count; ++i) times.push_back(entries[i].timestamp);
    return upper_median(times);
  };
  return increases(first - count) && increases(first) && median(first) < median(first - count);
}

// Beginnings of the segments, the end last.
std::vector<std::size_t> segments_of(const std::vector<TimedFile>& entries) {
  std::vector<std::size_t> bounds{0};
  for (std::size_t i = 1; i < entries.size(); ++i) {
    if (restarts_at(entries, i)) bounds.push_back(i);
  }
  bounds.push_back(entries.size());
  return bounds;
}

// Median step from one line to the next, of those that lead to a later time.
double median_step(const std::vector<TimedFile>& entries) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    const double step = entries[i].timestamp - entries[i - 1].timestamp;
    if (step > 0.0) steps.push_back(step);
  }
  return steps.empty() ? 0.0 : upper_median(steps);
}

// True if the times are those of one recording without overlap or gap when they are sorted: then it is the
// lines that are out of order, not the clock. Where the clock restarted, times of the segments lie between
// one another; in a shuffled list the steps from line to line are much larger than the intervals.
bool are_of_one_recording(const std::vector<TimedFile>& entries) {
  constexpr double kShuffled = 4.0;  // intervals from line to line
  constexpr double kShortest = 0.6;  // of the steps from line to line, where the list is not shuffled
  constexpr double kLongest = 5.0;
  const double interval = median_interval(entries);
  const double step = median_step(entries);
  const double shortest = step > kShuffled * interval ? 0.0 : kShortest * step;
  std::vector<double> times;
  for (const auto& entry : entries) times.push_back(entry.timestamp);
  std::sort(times.begin(), times.end());
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double gap = times[i] - times[i - 1];
    if (gap < shortest || gap > kLongest * interval) return false;
  }
  return true;
}

// Sorts one segment and appends it.
void append_sorted(const std::vector<TimedFile>& segment, OrderedFiles& ordered) {
  struct Entry {
    TimedFile file;
    bool is_in_place;
  };
  const std::vector<bool> is_in_place = longest_increasing(segment);
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < segment.size(); ++i) entries.push_back({segment[i], is_in_place[i]});
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return is_earlier(a.file, b.file); });
  // A line in the wrong place leaves a gap that its time fits in; a corrupt timestamp is far from all others,
  // or, which tells nothing where hardly a line is in place, next to one.
  const auto in_place = std::count(is_in_place.begin(), is_in_place.end(), true);
  const bool is_mostly_sorted = 2 * static_cast<std::size_t>(in_place) > segment.size();
  const double interval = median_interval(segment);
  const double near = is_mostly_sorted ? 0.3 * interval : 0.0;
  const double far = 30.0 * interval;
  const auto fits = [&](std::size_t i) {
    const double before = i > 0 ? entries[i].file.timestamp - entries[i - 1].file.timestamp : INFINITY;
    const double after =
        i + 1 < entries.size() ? entries[i + 1].file.timestamp - entries[i].file.timestamp : INFINITY;
    const double nearest = std::min(before, after);
    return nearest >= near && nearest <= far;
  };
  const std::size_t begin = ordered.entries.size();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const bool is_repeated =
        ordered.entries.size() > begin && !is_earlier(ordered.entries.back(), entries[i].file);
    if (is_repeated) {
      ++ordered.repeated;
    } else if (!entries[i].is_in_place && !fits(i)) {
      ++ordered.implausible;
    } else {
      ordered.was_sorted &= entries[i].is_in_place;
      ordered.entries.push_back(entries[i].file);
    }
  }
}
}  // namespace

TimedFileList read_timed_files(const fs::path& list_file) {
  std::ifstream in(list_file);
  if (!in || fs::is_directory(list_file)) {
    throw InputError(list_file.string() +
                     ": cannot open it; a TUM RGB-D folder holds rgb.txt, depth.txt and the images "
                     "they name");
  }
  TimedFileList list;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // some editors put it before the first line
    if (number == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
    const std::string_view rest = trimmed(text.substr(word.size()));
    const auto time = parse_time(word);
    if (!time || rest.empty()) {
      throw InputError(list_file.string() + ":" + std::to_string(number) +
                       ": expected 'timestamp file', got '" + excerpt(line) +
                       "'; correct or remove the line");
    }
    if (std::isfinite(*time)) {
      list.entries.push_back({*time, file_named(list_file.parent_path(), rest)});
    } else {
      ++list.without_time;
    }
  }
  if (list.entries.empty())
    throw InputError(list_file.string() + ": names no image; is the dataset complete?");
  return list;
}

double median_interval(const std::vector<TimedFile>& entries) {
  std::map<int, std::vector<double>> times;  // by segment
  for (const auto& entry : entries) times[entry.segment].push_back(entry.timestamp);
  std::vector<double> intervals;
  for (auto& [segment, all] : times) {
    std::sort(all.begin(), all.end());
    for (std::size_t i = 1; i < all.size(); ++i) {
      if (all[i] > all[i - 1]) intervals.push_back(all[i] - all[i - 1]);
    }
  }
  return intervals.empty() ? 0.0 : upper_median(intervals);
}

TimeUnit time_unit_of(const std::vector<TimedFile>& entries, double fps) {
  constexpr std::size_t kFewest = 5;
  constexpr double kMostFrames = 1e8;  // number of a frame
  const double interval = median_interval(entries);
  if (entries.size() < kFewest || interval <= 0.0) return {};
  const bool is_whole = std::all_of(entries.begin(), entries.end(), [](const TimedFile& entry) {
    return entry.timestamp == std::round(entry.timestamp) && std::abs(entry.timestamp) < kMostFrames;
  });
  std::vector<TimeUnit> units{
      {1.0, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}};
  if (is_whole) units.push_back({1.0 / fps, "numbers of frames"});
  // A recording may lack images of the camera, but hardly has more than it takes.
  constexpr double kMoreImages = 3.0;
  const auto distance = [&](const TimeUnit& unit) {
    const double missing = std::log(interval * unit.seconds * fps);
    return missing >= 0.0 ? missing : -kMoreImages * missing;
  };
  return *std::min_element(units.begin(), units.end(),
                           [&](const TimeUnit& a, const TimeUnit& b) { return distance(a) < distance(b); });
}

OrderedFiles in_order_of_time(std::vector<TimedFile> entries) {
  OrderedFiles ordered;
  std::vector<std::size_t> bounds = segments_of(entries);
  if (bounds.size() > 2 && are_of_one_recording(entries)) bounds = {0, entries.size()};
  ordered.restarts = static_cast<int>(bounds.size()) - 2;
  for (std::size_t s = 0; s + 1 < bounds.size(); ++s) {
    std::vector<TimedFile> segment(
        std::make_move_iterator(entries.begin() + static_cast<std::ptrdiff_t>(bounds[s])),
        std::make_move_iterator(entries.begin() + static_cast<std::ptrdiff_t>(bounds[s + 1])));
    for (auto& entry : segment) entry.segment = static_cast<int>(s);
    append_sorted(segment, ordered);
  }
  return ordered;
}

TimeUnit convert_to_seconds(const std::vector<TimedFileList*>& lists, double fps, Counts& notes) {
  const TimeUnit unit = time_unit_of(lists.front()->entries, fps);
  if (unit.seconds == 1.0) return unit;
  ++notes["timestamps are " + std::string(unit.name) + " by the camera's fps; converted to seconds"];
  for (TimedFileList* list : lists) {
    for (auto& entry : list->entries) entry.timestamp *= unit.seconds;
  }
  return unit;
}

std::vector<TimedFile> ordered_entries(const std::string& name, const std::string& kind, TimedFileList list,
                                       Counts& notes, Counts& skipped) {
  OrderedFiles files = in_order_of_time(std::move(list.entries));
  if (!files.was_sorted) ++notes[name + " was not in the order of time; sorted"];
  count(notes, "the clock restarts in " + name + "; a new segment begins there",
        static_cast<std::size_t>(files.restarts));
  count(skipped, kind + " without a time", list.without_time);
  count(skipped, kind + " with the time of another", files.repeated);
  count(skipped, kind + " with a time that does not fit the others", files.implausible);
  return std::move(files.entries);
}

}  // namespace roslam
