// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "recording/recorded_run.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/stereo/dense_stereo.hpp"

namespace roslam::recording {

/// Restores the frames of a recorded run from source images before and after them. Not thread-safe.
class SequenceRestorer {
 public:
  /// run and restorer must outlive it.
  SequenceRestorer(const RecordedRun& run, StaticSceneRestorer& restorer);

  /// Whether the frame of that timestamp is used as a source image.
  bool is_source(double timestamp) const;

  /// Adds a frame as a source image, if it has pose, depth and mask.
  void keep(const Frame& frame);

  /// Nothing, and counted in left_out(), if the run did not process the frame or its mask is missing.
  std::optional<RestoredImage> restore(const Frame& frame);

  std::size_t sources() const { return sources_.size(); }

  /// Number of frames that could not be restored so far, by reason.
  const std::map<std::string, std::size_t>& left_out() const { return left_out_; }

 private:
  std::optional<PosedImage> posed_image(const Frame& frame, std::string& reason) const;

  const RecordedRun& run_;
  std::optional<DenseStereo> stereo_;  // gives the depth of stereo pairs
  StaticSceneRestorer& restorer_;
  RestorationOptions options_;
  std::set<std::string> source_times_;  // as time_text
  std::vector<std::unique_ptr<const SourceImage>> sources_;
  std::map<std::string, std::size_t> left_out_;
};

}  // namespace roslam::recording
