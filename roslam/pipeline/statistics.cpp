// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/statistics.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <limits>
#include <numeric>
#include <sstream>

namespace roslam {

void StageTimes::add_all(const StageTimes& other) {
  for (const auto& [stage, samples] : other.samples_) {
    auto& mine = samples_[stage];
    mine.insert(mine.end(), samples.begin(), samples.end());
  }
}

std::map<std::string, StageSummary> StageTimes::summary() const {
  std::map<std::string, StageSummary> result;
  for (const auto& [stage, samples] : samples_) {
    std::vector<double> sorted = samples;
    std::sort(sorted.begin(), sorted.end());
    const auto quantile = [&](double share) {
      const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
      return 1e3 * sorted[std::max<std::size_t>(rank, 1) - 1];
    };
    const double mean =
        1e3 * std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(sorted.size());
    result[stage] = {sorted.size(), mean, quantile(0.5), quantile(0.95), 1e3 * sorted.back()};
  }
  return result;
}

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

}  // namespace roslam
