// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace roslam::app {

/// Prints progress on stderr: a bar on a terminal, else a line every few seconds.
class Progress {
 public:
  /// total: number of steps, if known.
  explicit Progress(std::optional<std::size_t> total, bool quiet = false);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Prints a line beside the progress, such as a warning; also if quiet.
  void print(const std::string& line);

  /// done: steps so far. state: one or two words, such as the tracking state.
  void show(std::size_t done, std::string_view state);

 private:
  using Clock = std::chrono::steady_clock;
  void print_bar(std::size_t done, std::string_view state, double elapsed) const;
  void print_line(std::size_t done, std::string_view state, double elapsed) const;

  std::optional<std::size_t> total_;
  bool quiet_;
  bool is_terminal_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

}  // namespace roslam::app
