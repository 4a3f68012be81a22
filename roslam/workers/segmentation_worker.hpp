// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "roslam/common/stage_times.hpp"
#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "roslam/options/options.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam {

/// Runs a segmenter on a thread of its own, so that what goes wrong in it costs labels and nothing else: what
/// it throws is counted, and in real-time mode one that does not answer is given up and left behind. In
/// deterministic mode an answer is waited for however long it takes, as a clock must not decide the result.
class SegmentationWorker {
 public:
  /// threads: how long an answer may take in real-time mode. Null segmenter: there never are labels.
  SegmentationWorker(std::shared_ptr<Segmenter> segmenter, Mode mode, const ThreadOptions& threads);

  /// Asks the segmenter to stop and leaves it behind if it does not.
  ~SegmentationWorker();
  SegmentationWorker(const SegmentationWorker&) = delete;
  SegmentationWorker& operator=(const SegmentationWorker&) = delete;

  bool is_on() const { return state_ != nullptr; }

  /// Offers a frame for labelling. In deterministic mode it is labelled at once; cancel() ends the wait. In
  /// real-time mode this never waits: the frame takes the place of the one that waits, if one does. colour
  /// must not be changed afterwards.
  void offer(std::size_t index, const cv::Mat& colour);

  /// Ends labelling; a wait for an answer ends at once. May be called from any thread.
  void cancel();

  /// The newest labels that were not taken yet. Never waits.
  std::optional<LabelledFrame> take();

  /// What went wrong so far, in words, and how often.
  std::map<std::string, std::size_t> faults() const;

  /// Processor time of the network.
  StageTimes times() const;

 private:
  struct State;  // shared with the thread, which may outlive the worker if the segmenter hangs
  static void work(const std::shared_ptr<State>& state);
  void note_delay();

  Mode mode_;
  ThreadOptions threads_;
  std::shared_ptr<State> state_;
};

}  // namespace roslam
