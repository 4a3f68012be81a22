// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>

#include "simulation/wrapped_source.hpp"

namespace roslam::simulation {

/// A camera that shows nothing from one frame on up to before another: its images are black, without depth.
class BlindedSource : public WrappedSource {
 public:
  /// source must outlive the object.
  BlindedSource(FrameSource& source, std::size_t from, std::size_t to)
      : WrappedSource(source), from_(from), to_(to) {}

  std::optional<Frame> next() override {
    auto frame = source().next();
    if (frame && frame->index >= from_ && frame->index < to_) {
      frame->colour = cv::Mat::zeros(frame->colour.size(), frame->colour.type());
      frame->depth = cv::Mat::zeros(frame->depth.size(), frame->depth.type());
    }
    return frame;
  }

 private:
  std::size_t from_, to_;
};

}  // namespace roslam::simulation
