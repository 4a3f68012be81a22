// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/keyframe_worker.hpp"

#include <utility>

#include "roslam/common/failure.hpp"

namespace roslam {

KeyframeWorker::KeyframeWorker(Work work, Mode mode, int interrupt_at, OnFailure on_failure)
    : work_(std::move(work)),
      mode_(mode),
      interrupt_at_(static_cast<std::size_t>(interrupt_at)),
      on_failure_(on_failure) {
  if (mode_ == Mode::kRealTime) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
}

KeyframeWorker::~KeyframeWorker() { cancel(); }

bool KeyframeWorker::is_idle() const {
  const std::scoped_lock lock(mutex_);
  return queue_.empty() && !is_busy_;
}

std::size_t KeyframeWorker::waiting() const {
  const std::scoped_lock lock(mutex_);
  return queue_.size();
}

void KeyframeWorker::submit(KeyframeId keyframe) {
  {
    const std::scoped_lock lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    if (is_cancelled_ || is_switched_off_) return;
    if (mode_ == Mode::kRealTime) {
      queue_.push_back(keyframe);
      changed_.notify_all();
      return;
    }
  }
  try {
    process(keyframe);
  } catch (...) {
    if (on_failure_ == OnFailure::kRethrow) throw;
    note_failure(std::current_exception());
  }
}

void KeyframeWorker::check() const {
  const std::scoped_lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

void KeyframeWorker::cancel() {
  const std::scoped_lock lock(mutex_);
  is_cancelled_ = true;
  queue_.clear();
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

std::map<std::string, std::size_t> KeyframeWorker::faults() const {
  const std::scoped_lock lock(mutex_);
  return faults_;
}

// A queue whose keyframes will never be processed must not look full: that would keep the tracker from
// creating keyframes, and so from learning of the failure.
void KeyframeWorker::note_failure(std::exception_ptr failure) {
  const std::scoped_lock lock(mutex_);
  queue_.clear();
  if (on_failure_ == OnFailure::kRethrow) {
    failure_ = std::move(failure);
  } else {
    ++faults_[message_of(failure)];
    is_switched_off_ = true;
  }
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
    } catch (...) {
      note_failure(std::current_exception());
    }
    lock.lock();
    is_busy_ = false;
    changed_.notify_all();
  }
}

void KeyframeWorker::process(KeyframeId keyframe) {
  const auto should_stop = [this] {
    return is_cancelled_ || (mode_ == Mode::kRealTime && waiting() >= interrupt_at_);
  };
  StageTimes times;
  work_(keyframe, should_stop, times);
  const std::scoped_lock lock(mutex_);
  times_.add_all(times);
}

}  // namespace roslam
