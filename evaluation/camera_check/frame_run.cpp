// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/frame_run.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace roslam::evaluation {

namespace {
constexpr std::size_t kShortest = 10;   // frames of a run
constexpr std::size_t kFewestRuns = 8;  // of a short recording, whose runs are shorter
}  // namespace

FrameRunSampler::FrameRunSampler(FrameSource& source, const FrameRunOptions& options,
                                 std::function<void(std::size_t, std::size_t)> progress)
    : source_(source), options_(options), progress_(std::move(progress)) {
  expected_ = options.length * options.most_runs;
  if (const auto size = source.size()) expected_ = std::min(*size, options.most_read);
  options_.length = std::clamp(expected_ / kFewestRuns, kShortest, std::max(kShortest, options.length));
  const std::size_t runs = std::clamp<std::size_t>(expected_ / options_.length, 1, options.most_runs);
  interval_ = std::max(expected_ / runs, options_.length);
}

std::optional<FrameRun> FrameRunSampler::next(const std::stop_token& stop) {
  FrameRun run;
  std::optional<std::size_t> last_index;
  int segment = 0;
  while (runs_ < options_.most_runs && read_ < expected_) {
    std::optional<Frame> frame = source_.next(stop);
    if (!frame) break;
    progress_(++read_, expected_);
    if (!frame->depth.empty()) ++with_depth_;
    const bool follows = !last_index || (frame->index == *last_index + 1 && frame->segment == segment);
    last_index = frame->index;
    segment = frame->segment;
    if (frame->depth.empty() || !follows) run.clear();
    if (frame->depth.empty() || (run.empty() && read_ <= runs_ * interval_)) continue;
    CheckFrame taken{frame->timestamp, {}, frame->depth, frame->T_world_camera};
    cv::cvtColor(frame->colour, taken.grey, cv::COLOR_BGR2GRAY);
    run.push_back(std::move(taken));
    if (run.size() < options_.length) continue;
    ++runs_;
    return run;
  }
  return std::nullopt;
}

}  // namespace roslam::evaluation
