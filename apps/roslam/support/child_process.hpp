// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

namespace roslam::app {

/// How a child process ended.
struct ChildResult {
  int code = -1;          ///< exit code; -1 if a signal ended it
  int signal = 0;         ///< the signal that ended it, or 0
  std::string last_line;  ///< last line it wrote to stderr
};

/// Runs this program again with other arguments and waits for it. Its stdout is discarded, its stderr goes to
/// the file `log`. If a stop is requested, the child gets SIGTERM once and is waited for. Throws OutputError
/// if the process cannot be started or the log cannot be created.
ChildResult run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                             const std::stop_token& stop);

}  // namespace roslam::app
