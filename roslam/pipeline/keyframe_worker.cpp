// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/mapping_worker.hpp"

namespace roslam {

MappingWorker::MappingWorker(LocalMapper& mapper, Mode mode, int queue_size)
    : mapper_(mapper), mode_(mode), queue_size_(static_cast<std::size_t>(queue_size)) {
  if (mode_ == Mode::kRealTime) {
    thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  }
}

bool MappingWorker::is_idle() const {
  const std::scoped_lock lock(mutex_);
  return queue_.empty() && !is_busy_;
}

bool MappingWorker::has_room() const {
  const std::scoped_lock lock(mutex_);
  return queue_.size() < queue_size_;
}

void MappingWorker::submit(KeyframeId keyframe) {
  if (mode_ == Mode::kDeterministic) {
    process(keyframe);
    return;
  }
  const std::scoped_lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  queue_.push_back(keyframe);
  changed_.notify_all();
}

void MappingWorker::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || (queue_.empty() && !is_busy_); });
  if (failure_) std::rethrow_exception(failure_);
}

StageTimes MappingWorker::times() const {
  const std::scoped_lock lock(mutex_);
  return times_;
}

void MappingWorker::work(const std::stop_token& stop) {
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

void MappingWorker::process(KeyframeId keyframe) {
  // The next keyframe matters more than the last step of refining this one.
  const auto should_stop = [this] {
    const std::scoped_lock lock(mutex_);
    return !queue_.empty();
  };
  mapper_.process(keyframe, mode_ == Mode::kRealTime ? std::function<bool()>(should_stop) : nullptr);
  const LocalMapper::Times& t = mapper_.times();
  const std::scoped_lock lock(mutex_);
  times_.add("mapping.landmarks", t.landmarks);
  times_.add("mapping.fusion", t.fusion);
  times_.add("mapping.bundle_adjustment", t.bundle);
  times_.add("mapping.culling", t.culling);
  times_.add("mapping", t.landmarks + t.fusion + t.bundle + t.culling);
}

}  // namespace roslam
