// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// Distribution of a stage's times.
struct ROSLAM_EXPORT StageSummary {
  std::size_t count = 0;
  double mean_ms = 0.0;
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;
};

/// Times of the stages of a run: processor time of the thread that ran them, unless said otherwise.
class ROSLAM_EXPORT StageTimes {
 public:
  void add(const std::string& stage, double seconds) { samples_[stage].push_back(seconds); }
  void add_all(const StageTimes& other);
  std::map<std::string, StageSummary> summary() const;

 private:
  std::map<std::string, std::vector<double>> samples_;
};

}  // namespace roslam
