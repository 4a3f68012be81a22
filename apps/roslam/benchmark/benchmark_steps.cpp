// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_steps.hpp"

#include <cstdio>
#include <utility>

#include "apps/roslam/support/child_process.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

namespace fs = std::filesystem;

BenchmarkSteps::BenchmarkSteps(fs::path out, std::string name, bool quiet, std::stop_token stop)
    : out_(std::move(out)), name_(std::move(name)), quiet_(quiet), stop_(std::move(stop)) {}

fs::path BenchmarkSteps::folder(const std::string& step) const {
  return out_ / "runs" / (name_ + "-" + step);
}

void BenchmarkSteps::call(const std::vector<std::string>& arguments, const std::string& step) const {
  if (!quiet_) std::fprintf(stderr, "%s: %s\n", name_.c_str(), step.c_str());
  make_folder(out_ / "runs");
  const auto ended = run_this_program(arguments, folder(step).string() + ".stderr.txt", stop_);
  if (stop_.stop_requested()) throw InputError("interrupted");
  if (ended.code != 0) throw InputError(step + " failed: " + ended.last_line);
}

void BenchmarkSteps::simulate(const BenchmarkSequence& flight, const BenchmarkSettings& settings,
                              const std::string& traffic, const std::string& depth,
                              const std::string& step) const {
  std::vector<std::string> arguments{"simulate",  flight.source.substr(flight.source.find(':') + 1),
                                     "--out",     folder(step).string(),
                                     "--traffic", traffic,
                                     "--depth",   depth,
                                     "--seed",    std::to_string(settings.seed)};
  if (settings.frames > 0) arguments.insert(arguments.end(), {"--frames", std::to_string(settings.frames)});
  call(arguments, step);
}

}  // namespace roslam::app
