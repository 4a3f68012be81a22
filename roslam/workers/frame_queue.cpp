// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/frame_queue.hpp"

#include <algorithm>
#include <utility>

namespace roslam {

// What dropped frames carry of the time between images goes to the next.
void FrameQueue::drop_front(std::deque<Waiting>& queue, Frame& next) {
  Frame& dropped = queue.front().frame;
  if (dropped.segment == next.segment) prepend_samples(std::move(dropped.inertial), next.inertial);
  queue.pop_front();
  ++dropped_;
}

void FrameQueue::push(Frame frame) {
  const std::scoped_lock lock(mutex_);
  const std::size_t number = pushed_++;
  if (closed_) {
    ++dropped_;
    return;
  }
  if (queue_.size() >= room_) {
    std::deque<Waiting> kept;
    while (!queue_.empty()) {
      kept.push_back(std::move(queue_.front()));
      queue_.pop_front();
      if (queue_.size() > 1) {
        drop_front(queue_, queue_[1].frame);
      } else if (!queue_.empty()) {
        drop_front(queue_, frame);
      }
    }
    queue_ = std::move(kept);
  }
  queue_.push_back({std::move(frame), number});
  changed_.notify_one();
}

std::optional<Frame> FrameQueue::pop() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || !queue_.empty(); });
  if (queue_.empty()) return std::nullopt;
  if (queue_.size() > relaxed_ && !closed_) {
    drop_front(queue_, queue_[1].frame);
  }
  while (policy_ == Policy::kNewest && queue_.size() > 1) drop_front(queue_, queue_[1].frame);
  Waiting next = std::move(queue_.front());
  queue_.pop_front();
  longest_gap_ = std::max(longest_gap_, next.number - expected_);
  expected_ = next.number + 1;
  return std::move(next.frame);
}

void FrameQueue::discard() {
  const std::scoped_lock lock(mutex_);
  queue_.clear();
  closed_ = true;
  changed_.notify_all();
}

void FrameQueue::close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

bool FrameQueue::is_closed() const {
  const std::scoped_lock lock(mutex_);
  return closed_;
}

std::size_t FrameQueue::dropped() const {
  const std::scoped_lock lock(mutex_);
  return dropped_;
}

std::size_t FrameQueue::longest_gap() const {
  const std::scoped_lock lock(mutex_);
  return longest_gap_;
}

}  // namespace roslam
