// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace roslam {

/// Exit code and output of a program.
struct Outcome {
  int code = -1;  ///< exit code, -1 if it ended by a signal
  std::string out;
  std::string error;
};

inline std::string content(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// Runs a shell command inside a folder and waits for it.
inline Outcome shell_in(const std::filesystem::path& folder, const std::string& command) {
  const std::string whole = "cd '" + folder.string() + "' && " + command + " >stdout 2>stderr";
  const int status = std::system(whole.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content(folder / "stdout"),
          content(folder / "stderr")};
}

}  // namespace roslam
