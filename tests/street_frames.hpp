// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "tests/street.hpp"

namespace roslam::street {

/// Tests that pass frames of the street, altered or not, to the library. They are read once for all cases.
class Street : public testing::Test {
 protected:
  static void SetUpTestSuite() { frames_ = std::make_unique<std::vector<Frame>>(frames()); }
  static void TearDownTestSuite() { frames_.reset(); }

  static Frame blank(std::size_t index, const cv::Scalar& colour) {
    Frame frame;
    frame.index = index;
    frame.timestamp = time_of(index);
    frame.colour = cv::Mat(480, 640, CV_8UC3, colour);
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(3.0));
    return frame;
  }

  // Frames of the flight up to end, with blank ones for [gap, gap_end).
  static std::vector<Frame> with_blank(std::size_t gap, std::size_t gap_end, std::size_t end,
                                       const cv::Scalar& colour) {
    std::vector<Frame> sequence;
    for (const auto& frame : *frames_) {
      if (frame.index < gap) sequence.push_back(frame);
    }
    for (std::size_t i = gap; i < gap_end; ++i) sequence.push_back(blank(i, colour));
    for (const auto& frame : *frames_) {
      if (frame.index >= gap_end && frame.index < end) sequence.push_back(frame);
    }
    return sequence;
  }

  // True T_world_camera of a frame, in the world frame of the first frame's estimate.
  static SE3 truth(const Frame& frame, const SE3& first_estimate) {
    return first_estimate * frames_->front().T_world_camera->inverse() * *frame.T_world_camera;
  }

  inline static std::unique_ptr<std::vector<Frame>> frames_;
};

}  // namespace roslam::street
