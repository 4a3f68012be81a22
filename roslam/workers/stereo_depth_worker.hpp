// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "roslam/common/stage_times.hpp"
#include "roslam/sensors/counts.hpp"
#include "roslam/stereo/dense_stereo.hpp"
#include "roslam/workers/dense_worker.hpp"
#include "roslam/workers/keyframe_jobs.hpp"
#include "roslam/workers/keyframe_worker.hpp"

namespace roslam {

/// Computes the depth images of keyframes that are stereo pairs, on a thread of its own at lower priority,
/// and hands the keyframes on in their order. In deterministic mode each is handed on at once. One whose
/// depth fails is handed on without, and counted; of too many that wait the oldest are left out and counted.
class StereoDepthWorker {
 public:
  using OnDepth = std::function<void(KeyframeId, DenseInput)>;

  /// on_depth: called on the worker's thread. queue: keyframes that may wait.
  StereoDepthWorker(DenseStereo stereo, Mode mode, int queue, OnDepth on_depth);

  void submit(KeyframeId keyframe, DenseInput input);

  /// Waits until all are handed on.
  void drain() { worker_.drain(); }

  /// Discards the keyframes that wait.
  void cancel() { worker_.cancel(); }

  std::size_t dropped() const { return jobs_.dropped(); }

  /// What went wrong so far, in words, and how often.
  Counts faults() const { return sum(jobs_.faults(), worker_.faults()); }

  StageTimes times() const { return worker_.times(); }

 private:
  void work(KeyframeId keyframe, StageTimes& times);

  DenseStereo stereo_;
  Mode mode_;
  OnDepth on_depth_;
  KeyframeJobs<DenseInput> jobs_;
  KeyframeWorker worker_;  // last, so that its thread stops before what it uses goes away
};

}  // namespace roslam
