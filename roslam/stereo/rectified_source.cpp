// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/stereo/rectified_source.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
bool is_same(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type() || a.empty()) return false;
  const std::size_t bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int y = 0; y < a.rows; ++y)
    if (std::memcmp(a.ptr(y), b.ptr(y), bytes) != 0) return false;
  return true;
}

// Nothing can be matched in it.
bool is_black(const cv::Mat& grey) {
  constexpr double kBrightest = 10.0;  // of 255
  double brightest = 0.0;
  cv::minMaxLoc(grey, nullptr, &brightest);
  return brightest < kBrightest;
}
}  // namespace

RectifiedSource::RectifiedSource(std::unique_ptr<FrameSource> source)
    : source_(std::move(source)), camera_(source_->camera()) {
  if (const auto right = source_->right()) {
    rectifier_.emplace(camera_, *right);
    if (camera_.is_stereo() && !rectifier_->is_identity())
      throw CalibrationError(
          "camera calibration: has a baseline, and so is of rectified images, but those of the "
          "source are not; give the calibration of the left camera as it is, or none");
    camera_ = rectifier_->camera();
  } else if (!camera_.is_stereo()) {
    throw InputError("the source has no stereo pairs: it names no right camera");
  }
}

std::optional<Frame> RectifiedSource::next() {
  while (auto frame = source_->next()) {
    const bool is_left_new = !is_same(frame->colour, last_left_);
    const bool is_right_new = !is_same(frame->right, last_right_);
    std::string fault = fault_of(*frame);
    if (fault.empty() && is_left_new && !is_right_new) fault = "right image is that of the frame before";
    last_left_ = frame->colour;
    if (!frame->right.empty()) last_right_ = frame->right;
    if (!is_left_new && is_right_new && fault.empty() && !frame->right.empty()) {
      ++skipped_["left image is that of the frame before"];
      prepend_samples(std::move(inertial_), frame->inertial);
      inertial_ = std::move(frame->inertial);
      continue;
    }
    if (!fault.empty()) {
      ++without_right_[fault];
      frame->right.release();
    }
    prepend_samples(std::exchange(inertial_, {}), frame->inertial);
    rectify(*frame);
    return frame;
  }
  return std::nullopt;
}

std::string RectifiedSource::fault_of(const Frame& frame) {
  if (frame.right.empty()) return {};
  if (frame.right.size() != frame.colour.size()) return "right image of another size than the left one";
  if (frame.right.type() != CV_8UC1) return "right image that is not 8-bit grey";
  if (is_black(frame.right)) return "right image is black";
  return {};
}

void RectifiedSource::rectify(Frame& frame) const {
  const bool has_size =
      frame.colour.size() == cv::Size(camera_.width, camera_.height);  // others are rejected later
  if (!rectifier_ || rectifier_->is_identity() || !has_size) return;
  frame.colour = rectifier_->left(frame.colour);
  if (!frame.right.empty()) frame.right = rectifier_->right(frame.right);
  frame.depth.release();  // of other pixels
  frame.labels.release();
  if (frame.T_world_camera) *frame.T_world_camera = *frame.T_world_camera * rectifier_->T_left_rectified();
}

}  // namespace roslam
