// SPDX-License-Identifier: BSD-3-Clause
// Takes the place of sqlite_recording.cpp where SQLite was not found.
#include "roslam/common/error.hpp"
#include "roslam/recordings/sqlite_recording.hpp"

namespace roslam {

std::unique_ptr<Recording> open_sqlite_recording(const std::filesystem::path& path) {
  throw InputError(
      path.string() +
      ": a recording in SQLite, which this program was built without; install libsqlite3-dev and "
      "build it again");
}

}  // namespace roslam
