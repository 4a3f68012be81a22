// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/segmentation_worker.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "roslam/common/thread_priority.hpp"

namespace roslam {

namespace {
using Clock = std::chrono::steady_clock;
constexpr auto kNoAnswer = "the segmenter does not answer";

struct Request {
  std::size_t index = 0;
  cv::Mat colour;
};
}  // namespace

struct SegmentationWorker::State {
  std::shared_ptr<Segmenter> segmenter;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Request> waiting;
  std::optional<LabelledFrame> answer;
  bool is_busy = false;
  bool is_late = false;  // the frame in work took too long, which has been counted
  bool should_stop = false;
  bool has_ended = false;
  Clock::time_point begun;
  std::map<std::string, std::size_t> faults;
  StageTimes times;
};

SegmentationWorker::SegmentationWorker(std::shared_ptr<Segmenter> segmenter, Mode mode,
                                       const ThreadOptions& threads)
    : mode_(mode), threads_(threads) {
  if (segmenter == nullptr) return;
  state_ = std::make_shared<State>();
  state_->segmenter = std::move(segmenter);
  // Detached, as nothing can end a thread that hangs in a network; all it touches is the state it shares.
  std::thread([state = state_, mode] {
    // An image more or less that is labelled matters less than a frame that is dropped.
    if (mode == Mode::kRealTime) lower_thread_priority(ThreadPriority::kLow);
    work(state);
  }).detach();
}

SegmentationWorker::~SegmentationWorker() {
  if (state_ == nullptr) return;
  std::unique_lock lock(state_->mutex);
  state_->should_stop = true;
  state_->changed.notify_all();
  if (state_->is_late) return;
  state_->changed.wait_for(lock, std::chrono::duration<double>(threads_.segmentation_timeout),
                           [&] { return state_->has_ended; });
}

void SegmentationWorker::work(const std::shared_ptr<State>& state) {
  std::unique_lock lock(state->mutex);
  while (true) {
    state->changed.wait(lock, [&] { return state->should_stop || state->waiting; });
    if (state->should_stop) break;
    const Request request = *std::exchange(state->waiting, std::nullopt);
    state->is_busy = true;
    state->begun = Clock::now();
    lock.unlock();
    std::optional<LabelledFrame> answer;
    std::string fault;
    try {
      answer = LabelledFrame{request.index, state->segmenter->segment(request.colour)};
    } catch (const std::exception& error) {
      fault = std::string("the segmenter failed: ") + error.what();
    } catch (...) {
      fault = "the segmenter failed";
    }
    lock.lock();
    if (!fault.empty()) ++state->faults[fault];
    if (answer) state->times.add("segmentation", answer->segmentation.seconds);
    state->answer = std::move(answer);
    state->is_busy = false;
    state->is_late = false;
    state->changed.notify_all();
  }
  state->segmenter.reset();
  state->has_ended = true;
  state->changed.notify_all();
}

// Called with the lock held.
void SegmentationWorker::note_delay() {
  const double seconds = std::chrono::duration<double>(Clock::now() - state_->begun).count();
  if (!state_->is_busy || state_->is_late || seconds < threads_.segmentation_timeout) return;
  state_->is_late = true;
  ++state_->faults[kNoAnswer];
}

void SegmentationWorker::offer(std::size_t index, const cv::Mat& colour) {
  if (state_ == nullptr) return;
  std::unique_lock lock(state_->mutex);
  if (state_->should_stop) return;
  if (mode_ == Mode::kRealTime) {
    note_delay();
    state_->waiting = Request{index, colour};
    state_->changed.notify_all();
    return;
  }
  state_->waiting = Request{index, colour};
  state_->answer.reset();
  state_->changed.notify_all();
  state_->changed.wait(lock, [&] { return state_->should_stop || (!state_->waiting && !state_->is_busy); });
}

void SegmentationWorker::cancel() {
  if (state_ == nullptr) return;
  const std::scoped_lock lock(state_->mutex);
  state_->should_stop = true;
  state_->changed.notify_all();
}

std::optional<LabelledFrame> SegmentationWorker::take() {
  if (state_ == nullptr) return std::nullopt;
  const std::scoped_lock lock(state_->mutex);
  return std::exchange(state_->answer, std::nullopt);
}

std::map<std::string, std::size_t> SegmentationWorker::faults() const {
  if (state_ == nullptr) return {};
  const std::scoped_lock lock(state_->mutex);
  return state_->faults;
}

StageTimes SegmentationWorker::times() const {
  if (state_ == nullptr) return {};
  const std::scoped_lock lock(state_->mutex);
  return state_->times;
}

}  // namespace roslam
