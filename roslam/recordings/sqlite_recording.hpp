// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "roslam/recordings/recording.hpp"

namespace roslam {

/// True if a file begins as one of SQLite does.
inline bool is_sqlite_file(std::string_view first_bytes) {
  return first_bytes.starts_with(std::string_view("SQLite format 3\0", 16));
}

/// Opens the SQLite file of a rosbag2 recording for reading alone: nothing is written beside it, not even if
/// a crash left a journal. Messages are fetched one by one, in the order of time by the file's index. Throws
/// InputError, also if this library was built without SQLite.
std::unique_ptr<Recording> open_sqlite_recording(const std::filesystem::path& path);

}  // namespace roslam
