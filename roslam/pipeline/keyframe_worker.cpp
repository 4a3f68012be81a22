// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/keyframe_worker.hpp"

#include <utility>

namespace roslam {

KeyframeWorker::KeyframeWorker(Work work, Mode mode, int patience)
    : work_(std::move(work)), mode_(mode), patience_(static_cast<std::size_t>(patience)) {
  if (mode_ == Mode::kRealTime) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
}

bool KeyframeWorker::is_idle() const {
  const std::scoped_lock lock(mutex_);
  return queue_.empty() && !is_busy_;
}

std::size_t KeyframeWorker::waiting() const {
  const std::scoped_lock lock(mutex_);
  return queue_.size();
}

void KeyframeWorker::submit(KeyframeId keyframe) {
  if (mode_ == Mode::kDeterministic) {
    process(keyframe);
    return;
  }
  const std::scoped_lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  queue_.push_back(keyframe);
  changed_.notify_all();
}

void KeyframeWorker::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || (queue_.empty() && !is_busy_); });
  if (failure_) std::rethrow_exception(failure_);
}

StageTimes KeyframeWorker::times() const {
  const std::scoped_lock lock(mutex_);
  return times_;
}

void KeyframeWorker::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !queue_.empty(); })) {
    const KeyframeId keyframe = queue_.front();
    queue_.pop_front();
    is_busy_ = true;
    lock.unlock();
    try {
      process(keyframe);
      lock.lock();
    } catch (...) {
      lock.lock();
      failure_ = std::current_exception();
      changed_.notify_all();
      return;
    }
    is_busy_ = false;
    changed_.notify_all();
  }
}

void KeyframeWorker::process(KeyframeId keyframe) {
  const auto should_stop = [this] { return waiting() >= patience_; };
  StageTimes times;
  work_(keyframe, mode_ == Mode::kRealTime ? ShouldStop(should_stop) : nullptr, times);
  const std::scoped_lock lock(mutex_);
  times_.add_all(times);
}

}  // namespace roslam
