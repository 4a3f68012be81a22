// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/callback_queue.hpp"

#include <chrono>
#include <utility>

#include "roslam/common/failure.hpp"

namespace roslam {

namespace {
constexpr std::size_t kRoom = 64;  // calls that may wait: two seconds of frames
}

CallbackQueue::CallbackQueue(Mode mode) : mode_(mode) {
  if (mode == Mode::kRealTime) thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

CallbackQueue::~CallbackQueue() { stop(); }

void CallbackQueue::stop() {
  cancel();
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void CallbackQueue::post(std::function<void()> function) {
  std::unique_lock lock(mutex_);
  if (is_cancelled_) return;
  if (mode_ == Mode::kDeterministic) {
    lock.unlock();
    return call(function);
  }
  waiting_.push_back(std::move(function));
  if (waiting_.size() > kRoom) {
    waiting_.pop_front();
    ++dropped_;
  }
  changed_.notify_all();
}

void CallbackQueue::call(const std::function<void()>& function) {
  const auto outer = [&] {
    const std::scoped_lock lock(mutex_);
    return std::exchange(caller_, std::this_thread::get_id());
  }();
  std::string fault;
  try {
    function();
  } catch (...) {
    fault = message_of(std::current_exception());
  }
  const std::scoped_lock lock(mutex_);
  caller_ = outer;
  if (!fault.empty()) ++faults_[fault];
}

void CallbackQueue::work(const std::stop_token& stop) {
  while (true) {
    std::function<void()> next;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return !waiting_.empty(); });
      if (stop.stop_requested() || waiting_.empty()) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
      is_busy_ = true;
    }
    call(next);
    const std::scoped_lock lock(mutex_);
    is_busy_ = false;
    changed_.notify_all();
  }
}

void CallbackQueue::drain() {
  std::unique_lock lock(mutex_);
  constexpr auto kLongest = std::chrono::seconds(1);
  changed_.wait_for(lock, kLongest, [this] { return is_cancelled_ || (waiting_.empty() && !is_busy_); });
}

void CallbackQueue::cancel() {
  const std::scoped_lock lock(mutex_);
  is_cancelled_ = true;
  waiting_.clear();
  changed_.notify_all();
}

bool CallbackQueue::is_inside() const {
  const std::scoped_lock lock(mutex_);
  return caller_ == std::this_thread::get_id();
}

std::size_t CallbackQueue::dropped() const {
  const std::scoped_lock lock(mutex_);
  return dropped_;
}

std::map<std::string, std::size_t> CallbackQueue::faults() const {
  const std::scoped_lock lock(mutex_);
  return faults_;
}

}  // namespace roslam
