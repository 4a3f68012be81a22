// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace roslam {

/// A queue between two threads that holds so many elements and no more: a newer one takes the place of the
/// oldest.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Never waits. Returns how many elements were lost: the oldest ones, to make room, or this
  /// one if the queue is closed.
  std::size_t push(T element) {
    const std::scoped_lock lock(mutex_);
    if (closed_) return 1;
    std::size_t dropped = 0;
    for (; queue_.size() >= capacity_; ++dropped) queue_.pop_front();
    queue_.push_back(std::move(element));
    changed_.notify_one();
    return dropped;
  }

  /// Waits for an element; nothing once the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !queue_.empty(); });
    if (queue_.empty()) return std::nullopt;
    T element = std::move(queue_.front());
    queue_.pop_front();
    return element;
  }

  /// Removes all elements and closes the queue: elements that are pushed from now on are lost.
  void discard() {
    const std::scoped_lock lock(mutex_);
    queue_.clear();
    closed_ = true;
    changed_.notify_all();
  }

  /// No more elements will come.
  void close() {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> queue_;
  bool closed_ = false;
};

}  // namespace roslam
