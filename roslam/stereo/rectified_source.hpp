// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/sensors/counts.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/stereo/stereo_rectifier.hpp"

namespace roslam {

/// The frames of a source of stereo pairs, rectified. A right image that is black, of another size or that of
/// the frame before (a camera that hangs) is left out and counted in skipped_depth(), where sources count
/// those that are missing: its frame has only the left one. A frame whose left image is that of the frame
/// before, while the right one is new, is skipped.
class ROSLAM_EXPORT RectifiedSource : public FrameSource {
 public:
  /// Throws InputError if the source has no stereo pairs, CalibrationError as StereoRectifier.
  explicit RectifiedSource(std::unique_ptr<FrameSource> source);

  std::optional<Frame> next() override;
  using FrameSource::next;
  void interrupt() override { source_->interrupt(); }
  bool is_live() const override { return source_->is_live(); }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return source_->size(); }
  Counts skipped() const override { return sum(source_->skipped(), skipped_); }
  Counts notes() const override { return source_->notes(); }
  Counts skipped_depth() const override { return sum(source_->skipped_depth(), without_right_); }

  /// The source as it is.
  const FrameSource& source() const { return *source_; }

 private:
  // Why a right image is of no use by itself; empty: it is.
  static std::string fault_of(const Frame& frame);
  void rectify(Frame& frame) const;

  std::unique_ptr<FrameSource> source_;
  std::optional<StereoRectifier> rectifier_;  // none: the source's pairs are rectified
  Camera camera_;
  cv::Mat last_left_, last_right_;        // as the source gave them
  std::vector<InertialSample> inertial_;  // of frames that were skipped
  Counts skipped_, without_right_;
};

}  // namespace roslam
