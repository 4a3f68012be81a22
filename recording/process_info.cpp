// SPDX-License-Identifier: BSD-3-Clause
#include "recording/process_info.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

namespace roslam::recording {

std::size_t peak_memory() {
  // getrusage alone would count what the process held before it became this program: the copy of its parent.
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

double process_age() {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  constexpr int kFieldsBetween =
      19;  // from the state, which follows the name, to the start in ticks since boot
  std::string text;
  std::getline(std::ifstream("/proc/self/stat"), text);
  // The name stands in parentheses and may itself hold spaces and parentheses.
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return kUnknown;
  std::istringstream fields(text.substr(name_end + 1));
  std::string skipped;
  for (int i = 0; i < kFieldsBetween; ++i) fields >> skipped;
  double start_ticks = 0.0;
  timespec now{};
  if (!(fields >> start_ticks) || clock_gettime(CLOCK_BOOTTIME, &now) != 0) return kUnknown;
  const double since_boot = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  return since_boot - start_ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

}  // namespace roslam::recording
