// SPDX-License-Identifier: BSD-3-Clause
// Preloaded into the program by a test: a thread that runs before main() and blocks no signal, as libraries
// for linear algebra start them.
#include <chrono>
#include <thread>

namespace {
const bool kStarted = [] {
  std::thread([] {
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }).detach();
  return true;
}();
}  // namespace
