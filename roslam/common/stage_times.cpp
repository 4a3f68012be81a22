// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/stage_times.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

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
    result[stage] = {sorted.size(), mean, quantile(0.5), quantile(0.95), quantile(0.99), 1e3 * sorted.back()};
  }
  return result;
}

}  // namespace roslam
