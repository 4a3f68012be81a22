// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "roslam/map/ids.hpp"

namespace roslam {

/// What a worker still has to do about keyframes: of more jobs than there is room for the oldest go and are
/// counted, and so is what goes wrong with the others. Safe to use from several threads.
template <typename Job>
class KeyframeJobs {
 public:
  /// room: jobs that may wait.
  explicit KeyframeJobs(int room) : room_(static_cast<std::size_t>(room)) {}

  /// Returns the keyframes whose jobs had to go.
  std::vector<KeyframeId> put(KeyframeId keyframe, Job job) {
    const std::scoped_lock lock(mutex_);
    waiting_.emplace(keyframe, std::move(job));
    std::vector<KeyframeId> gone;
    for (; waiting_.size() > room_; waiting_.erase(waiting_.begin())) gone.push_back(waiting_.begin()->first);
    dropped_ += gone.size();
    return gone;
  }

  /// Nothing if the job had to go.
  std::optional<Job> take(KeyframeId keyframe) {
    const std::scoped_lock lock(mutex_);
    auto job = waiting_.extract(keyframe);
    return job.empty() ? std::nullopt : std::optional<Job>(std::move(job.mapped()));
  }

  void note_fault(const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    ++faults_[error.what()];
  }

  std::size_t dropped() const {
    const std::scoped_lock lock(mutex_);
    return dropped_;
  }

  /// What went wrong so far, in words, and how often.
  std::map<std::string, std::size_t> faults() const {
    const std::scoped_lock lock(mutex_);
    return faults_;
  }

 private:
  std::size_t room_;
  mutable std::mutex mutex_;  // guards what follows
  std::map<KeyframeId, Job> waiting_;
  std::size_t dropped_ = 0;
  std::map<std::string, std::size_t> faults_;
};

}  // namespace roslam
