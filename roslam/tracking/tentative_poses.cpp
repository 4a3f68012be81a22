// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/tentative_poses.hpp"

#include <utility>

namespace roslam {

namespace {
constexpr double kLongest = 0.5;  // seconds; what nothing has contradicted for that long stays
}

void TentativePoses::add(const TrackedState& state, bool is_strong) {
  has_tentative_ = !is_strong && confirmed_ && state.frame.timestamp - confirmed_->frame.timestamp < kLongest;
  if (has_tentative_) return;
  confirmed_ = state;
  keyframes_.clear();
}

void TentativePoses::add_keyframe(KeyframeId keyframe) {
  if (has_tentative_) {
    keyframes_.push_back(keyframe);
  } else if (confirmed_) {
    confirmed_->frame.reference = keyframe;
    confirmed_->T_camera_reference = SE3();
  }
}

const TrackedState* TentativePoses::confirmed(double timestamp) const {
  const bool is_recent = has_tentative_ && timestamp - confirmed_->frame.timestamp < 2.0 * kLongest;
  return is_recent ? &*confirmed_ : nullptr;
}

Withdrawal TentativePoses::withdraw() {
  has_tentative_ = false;
  return {confirmed_->frame.timestamp, std::exchange(keyframes_, {}), confirmed_->frame.reference};
}

void TentativePoses::restart() {
  confirmed_.reset();
  has_tentative_ = false;
  keyframes_.clear();
}

}  // namespace roslam
