// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

namespace roslam::app {

/// How a child process ended.
struct ChildResult {
  int code = -1;           ///< exit code; -1 if a signal ended it
  int signal = 0;          ///< the signal that ended it, or 0
  std::string last_words;  ///< last line it wrote to stderr
};

/// Starts this very program again with other arguments and waits for it. Its stdout goes nowhere, its stderr
/// to the file `log`. If a stop is requested, the child is asked to end (once) and waited for. Throws
/// OutputError if the process or the log cannot be made.
ChildResult run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                             const std::stop_token& stop);

}  // namespace roslam::app
