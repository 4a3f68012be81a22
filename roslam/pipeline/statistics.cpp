// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/statistics.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>

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
    result[stage] = {sorted.size(), quantile(0.5), quantile(0.95), 1e3 * sorted.back()};
  }
  return result;
}

std::size_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

}  // namespace roslam
