// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/pausable_source.hpp"

#include <algorithm>

namespace roslam::app {

void PausableSource::pause(bool is_paused) {
  {
    const std::scoped_lock lock(mutex_);
    is_paused_ = is_paused;
  }
  changed_.notify_all();
}

void PausableSource::interrupt() {
  {
    const std::scoped_lock lock(mutex_);
    is_interrupted_ = true;
  }
  changed_.notify_all();
  WrappedSource::interrupt();
}

std::optional<Frame> PausableSource::next() {
  {
    std::unique_lock lock(mutex_);
    if (is_paused_ && !is_interrupted_) {
      changed_.wait(lock, [this] { return !is_paused_ || is_interrupted_; });
      due_ = Clock::now();
    }
  }
  auto frame = WrappedSource::next();
  if (!frame || !is_paced_) return frame;
  std::unique_lock lock(mutex_);
  if (due_) {  // the reader, who is behind by the pause, does not wait any more
    *due_ += std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(std::clamp(frame->timestamp - timestamp_, 0.0, 1.0)));
    changed_.wait_until(lock, *due_, [this] { return is_interrupted_; });
  }
  timestamp_ = frame->timestamp;
  return frame;
}

}  // namespace roslam::app
