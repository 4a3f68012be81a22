// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/stereo_depth_worker.hpp"

#include <exception>
#include <utility>

#include "roslam/common/stopwatch.hpp"
#include "roslam/common/thread_priority.hpp"

namespace roslam {

StereoDepthWorker::StereoDepthWorker(DenseStereo stereo, Mode mode, int queue, OnDepth on_depth)
    : stereo_(std::move(stereo)),
      mode_(mode),
      on_depth_(std::move(on_depth)),
      jobs_(queue),
      worker_([this](KeyframeId keyframe, const auto&, StageTimes& times) { work(keyframe, times); }, mode, 1,
              KeyframeWorker::OnFailure::kSwitchOff) {}

void StereoDepthWorker::submit(KeyframeId keyframe, DenseInput input) {
  jobs_.put(keyframe, std::move(input));
  worker_.submit(keyframe);
}

void StereoDepthWorker::work(KeyframeId keyframe, StageTimes& times) {
  if (mode_ == Mode::kRealTime) lower_thread_priority(ThreadPriority::kLow);
  auto input = jobs_.take(keyframe);
  if (!input) return;  // dropped
  try {
    const Stopwatch watch;
    const bool has_depth = !input->frame.depth.empty();
    input->frame = stereo_.with_depth(std::move(input->frame));
    if (!has_depth) times.add("stereo.dense", watch.seconds());
  } catch (const std::exception& error) {
    jobs_.note_fault(error);
  }
  on_depth_(keyframe, std::move(*input));
}

}  // namespace roslam
