// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/load_control.hpp"

#include <algorithm>

namespace roslam {

namespace {
constexpr double kSmoothing = 0.15;  // weight of the newest frame: an average over about 7 frames
constexpr double kHigh = 0.85;       // of the time between two images
constexpr double kLow = 0.6;
constexpr int kBeforeMore = 5;   // frames: the effect of the last measure must show first
constexpr int kBeforeLess = 30;  // frames

const char* in_words(LoadMeasure measure) {
  switch (measure) {
    case LoadMeasure::kRestorationWaits:
      return "restoration waits";
    case LoadMeasure::kDenseMapWaits:
      return "dense map waits";
    case LoadMeasure::kGeometryEverySecond:
      return "geometry of every second frame";
    case LoadMeasure::kLabelsEverySecond:
      return "labels of every second frame";
    case LoadMeasure::kNone:
      break;
  }
  return "nothing";
}
}  // namespace

LoadControl::LoadControl(Mode mode, double fps)
    : budget_(mode == Mode::kRealTime && fps > 0.0 ? 1.0 / fps : 0.0) {}

void LoadControl::note_frame(double seconds) {
  if (budget_ == 0.0) return;
  // One very long frame, such as a relocalisation, is not a load that lasts.
  load_ += kSmoothing * (std::min(seconds / budget_, 2.0) - load_);
  ++since_change_;
  const std::scoped_lock lock(mutex_);
  for (int level = 1; level <= level_; ++level) ++frames_[static_cast<std::size_t>(level)];
  int level = level_;
  if (load_ > kHigh && since_change_ >= kBeforeMore) level = std::min(level + 1, kLevels - 1);
  if (load_ < kLow && since_change_ >= kBeforeLess) level = std::max(level - 1, 0);
  if (level == level_) return;
  level_ = level;
  since_change_ = 0;
  changed_.notify_all();
}

void LoadControl::wait_while(LoadMeasure measure) {
  if (!is_taken(measure)) return;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return is_released_ || !is_taken(measure); });
}

void LoadControl::release() {
  const std::scoped_lock lock(mutex_);
  is_released_ = true;
  changed_.notify_all();
}

std::map<std::string, std::size_t> LoadControl::frames() const {
  const std::scoped_lock lock(mutex_);
  std::map<std::string, std::size_t> result;
  for (int level = 1; level < kLevels; ++level) {
    const std::size_t count = frames_[static_cast<std::size_t>(level)];
    if (count > 0) result[in_words(static_cast<LoadMeasure>(level))] = count;
  }
  return result;
}

}  // namespace roslam
