// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace roslam {

/// Distribution of a stage's times.
struct StageSummary {
  std::size_t count = 0;
  double mean_ms = 0.0;
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double max_ms = 0.0;
};

/// Times of the stages of a run: processor time of the thread that ran them.
class StageTimes {
 public:
  void add(const std::string& stage, double seconds) { samples_[stage].push_back(seconds); }
  void add_all(const StageTimes& other);
  std::map<std::string, StageSummary> summary() const;

 private:
  std::map<std::string, std::vector<double>> samples_;
};

/// Most memory the program has held so far, in bytes; what the program that started it held does not count.
std::size_t peak_memory();

/// Seconds since the process was started, to a hundredth; NaN where the system does not tell.
double process_age();

}  // namespace roslam
