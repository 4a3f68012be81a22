// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace roslam {

/// Divides the rows of an image among a few threads. Not thread safe.
class RowTeam {
 public:
  /// Work on the rows begin..end by the thread of that number, from 0.
  using Work = std::function<void(int begin, int end, int thread)>;

  explicit RowTeam(int threads) : size_(threads) {}
  ~RowTeam() { stop(); }
  RowTeam(const RowTeam&) = delete;
  RowTeam& operator=(const RowTeam&) = delete;

  int size() const { return size_; }

  /// Does the work on 0..rows and returns when all of it is done. The work must not throw.
  void run(int rows, const Work& work) {
    if (size_ == 1 || rows < size_) return work(0, rows, 0);
    if (threads_.empty()) start();
    work_ = &work;
    rows_ = rows;
    left_ = size_ - 1;
    ++round_;
    round_.notify_all();
    work(0, rows / size_, 0);
    for (int left = left_; left > 0; left = left_) left_.wait(left);
  }

 private:
  // By the thread that uses the team, whose priority the new ones inherit.
  void start() {
    try {
      for (int i = 1; i < size_; ++i) threads_.emplace_back([this, i] { serve(i); });
    } catch (...) {
      stop();
      throw;
    }
  }

  void stop() {
    should_stop_ = true;
    ++round_;
    round_.notify_all();
    threads_.clear();
  }

  void serve(int thread) {
    std::uint64_t seen = 0;
    while (true) {
      round_.wait(seen);
      seen = round_;
      if (should_stop_) return;
      (*work_)(thread * rows_ / size_, (thread + 1) * rows_ / size_, thread);
      if (--left_ == 0) left_.notify_all();
    }
  }

  int size_;
  const Work* work_ = nullptr;
  int rows_ = 0;
  std::atomic<std::uint64_t> round_{0};
  std::atomic<int> left_{0};
  std::atomic<bool> should_stop_{false};
  std::vector<std::jthread> threads_;  // last: they end before what they use does
};

}  // namespace roslam
