// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/sensors/counts.hpp"

namespace roslam {

/// One line of a list of images, such as rgb.txt.
struct ROSLAM_EXPORT TimedFile {
  double timestamp = 0.0;      ///< seconds; in a list just read, of the unit it is written in
  std::filesystem::path file;  ///< relative to the folder of the list
  int segment = 0;             ///< restarts of the clock before it
};

/// The lines of a list of images.
struct TimedFileList {
  std::vector<TimedFile> entries;
  std::size_t without_time = 0;  ///< lines whose time is not finite, which are left out
};

/// Reads lines "timestamp file"; # begins a comment. A file name may be quoted and may hold blanks, escaped
/// by a backslash or not, and backslashes in place of slashes; the spelling that exists is taken. Throws
/// InputError if the list is missing, malformed or names no image.
TimedFileList read_timed_files(const std::filesystem::path& list);

/// A unit of timestamps.
struct TimeUnit {
  double seconds = 1.0;
  std::string_view name = "seconds";
};

/// The unit of the timestamps of a camera: of seconds, milliseconds, microseconds, nanoseconds and, for whole
/// numbers, numbers of frames the one whose median interval is nearest to the camera's. Seconds for fewer
/// than five entries.
TimeUnit time_unit_of(const std::vector<TimedFile>& entries, double fps);

/// Median interval between the different times of each segment, in their unit; 0 for fewer than two times.
double median_interval(const std::vector<TimedFile>& entries);

/// A list in the order of time.
struct OrderedFiles {
  std::vector<TimedFile> entries;  ///< timestamps strictly increase within each segment
  std::size_t repeated = 0;        ///< left out, as their time is that of another
  std::size_t implausible = 0;     ///< left out, as their time fits neither their place nor another
  bool was_sorted = true;          ///< before
  int restarts = 0;                ///< of the clock
};

/// Sorts a list. Where the clock restarted, which shows in times that go on increasing from an earlier one, a
/// segment begins. A line that is out of order is left out where its time does not fit between others, as
/// that of a corrupt timestamp.
OrderedFiles in_order_of_time(std::vector<TimedFile> entries);

/// Converts the times of lists of one clock to seconds. The unit is that of the first list by the camera's
/// fps; where it is not seconds, a note says so. Returns it.
TimeUnit convert_to_seconds(const std::vector<TimedFileList*>& lists, double fps, Counts& notes);

/// The entries of a list in the order of time. name: of the list, kind: of its images, for the messages.
/// Lines that are left out are counted in skipped; notes says what was sorted and where the clock restarts.
std::vector<TimedFile> ordered_entries(const std::string& name, const std::string& kind, TimedFileList list,
                                       Counts& notes, Counts& skipped);

}  // namespace roslam
