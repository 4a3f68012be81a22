// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_run.hpp"
#include "apps/roslam/benchmark/benchmark_sequences.hpp"

namespace roslam::app {

/// The steps of a benchmark that run as processes of their own, and their folders OUT/runs/NAME-STEP.
class BenchmarkSteps {
 public:
  BenchmarkSteps(std::filesystem::path out, std::string name, bool quiet, std::stop_token stop);

  std::filesystem::path folder(const std::string& step) const;

  /// Runs this program and waits for its end. Throws InputError if it fails or is interrupted, and
  /// OutputError.
  void call(const std::vector<std::string>& arguments, const std::string& step) const;

  /// Renders a simulated flight to the folder of the step, as a recording with a known background. depth:
  /// ideal or d455.
  void simulate(const BenchmarkSequence& flight, const BenchmarkSettings& settings,
                const std::string& traffic, const std::string& depth, const std::string& step) const;

  const std::stop_token& stop() const { return stop_; }

 private:
  std::filesystem::path out_;
  std::string name_;
  bool quiet_;
  std::stop_token stop_;
};

}  // namespace roslam::app
