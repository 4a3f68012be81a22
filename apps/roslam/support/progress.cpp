// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace roslam::app {

namespace {
constexpr std::chrono::milliseconds kBarInterval{100};
constexpr std::chrono::milliseconds kLineInterval{5000};
constexpr int kBarWidth = 30;
}  // namespace

Progress::Progress(std::optional<std::size_t> total, bool quiet)
    : total_(total), quiet_(quiet), is_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_ && is_terminal_) std::fputs("\n", stderr);
}

void Progress::print(const std::string& line) {
  std::fprintf(stderr, "%s%s\n", shown_ && is_terminal_ ? "\n" : "", line.c_str());
}

void Progress::show(std::size_t done, std::string_view state) {
  const auto now = Clock::now();
  const bool is_last = total_ && done >= *total_;
  const auto interval = is_terminal_ ? kBarInterval : kLineInterval;
  if (quiet_ || (now - last_ < interval && !(is_last && is_terminal_))) return;
  last_ = now;
  shown_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  is_terminal_ ? print_bar(done, state, elapsed) : print_line(done, state, elapsed);
}

void Progress::print_bar(std::size_t done, std::string_view state, double elapsed) const {
  const double rate = elapsed > 0.0 ? static_cast<double>(done) / elapsed : 0.0;
  if (!total_) {
    std::fprintf(stderr, "\r%zu frames  %.1f fps  %-14.*s", done, rate, static_cast<int>(state.size()),
                 state.data());
    return;
  }
  const double share =
      std::min(1.0, static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(*total_, 1)));
  const auto filled = static_cast<std::size_t>(share * kBarWidth);
  const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
  const double left = rate > 0.0 ? static_cast<double>(*total_ - std::min(done, *total_)) / rate : 0.0;
  std::fprintf(stderr, "\r[%s] %zu/%zu  %.1f fps  %.0f s left  %-14.*s", bar.c_str(), done, *total_, rate,
               left, static_cast<int>(state.size()), state.data());
}

void Progress::print_line(std::size_t done, std::string_view state, double elapsed) const {
  const double rate = elapsed > 0.0 ? static_cast<double>(done) / elapsed : 0.0;
  std::string of;
  if (total_) of.append("/").append(std::to_string(*total_));
  std::fprintf(stderr, "%zu%s frames, %.1f fps, %.*s\n", done, of.c_str(), rate,
               static_cast<int>(state.size()), state.data());
}

}  // namespace roslam::app
