// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

#include "roslam/options/mode.hpp"

namespace roslam {

/// What gives way to tracking, what is needed least first. Each includes those before it.
enum class LoadMeasure {
  kNone,
  kRestorationWaits,     ///< keyframes wait to be restored; of too many the oldest keep their holes
  kDenseMapWaits,        ///< keyframes wait to be fused into the dense map
  kGeometryEverySecond,  ///< depth and flow are examined for motion in every second frame
  kLabelsEverySecond     ///< every second frame is offered to the network
};

/// Decides in real-time mode what gives way so that the tracking thread keeps up with the camera: one more
/// measure if its frames take most of the time between two images, one less if they leave time for a while.
/// In deterministic mode nothing ever gives way. Safe to use from several threads.
class LoadControl {
 public:
  /// fps: images a second of the camera; 0 if unknown, in which case nothing gives way.
  LoadControl(Mode mode, double fps);

  /// Takes the wall time (seconds) that the tracking thread took for a frame. Called by that thread.
  void note_frame(double seconds);

  bool is_taken(LoadMeasure measure) const { return level_ >= static_cast<int>(measure); }

  /// Waits while a measure is taken, until release(). Called by the threads that give way.
  void wait_while(LoadMeasure measure);

  /// From now on nothing waits: the last frame was tracked, or the run is cancelled.
  void release();

  /// By measure, in words: in how many frames it was taken. Empty if none ever was.
  std::map<std::string, std::size_t> frames() const;

 private:
  static constexpr int kLevels = static_cast<int>(LoadMeasure::kLabelsEverySecond) + 1;

  double budget_;         // seconds a frame; 0: unlimited
  double load_ = 0.0;     // moving average of the share of the budget that frames take
  int since_change_ = 0;  // frames
  std::atomic<int> level_ = 0;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool is_released_ = false;
  std::array<std::size_t, kLevels> frames_{};
};

}  // namespace roslam
