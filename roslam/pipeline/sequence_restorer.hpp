// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/pipeline/recorded_run.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam {

/// Restores the frames of a recorded run, from all of it: from what the camera saw before and after.
class SequenceRestorer {
 public:
  /// run and restorer must outlive it.
  SequenceRestorer(const RecordedRun& run, StaticSceneRestorer& restorer);

  /// Whether the frame of that time is one to fill others from.
  bool is_source(double timestamp) const;

  /// Keeps a frame to fill others from.
  void keep(const Frame& frame);

  /// Nothing if the run did not process the frame or lost its mask, which is counted.
  std::optional<RestoredView> restore(const Frame& frame);

  std::size_t sources() const { return sources_.size(); }

  /// Frames that could not be restored so far, by reason in words.
  const std::map<std::string, std::size_t>& left_out() const { return left_out_; }

 private:
  std::optional<View> view_of(const Frame& frame, std::string& reason) const;

  const RecordedRun& run_;
  StaticSceneRestorer& restorer_;
  RestorationOptions options_;
  std::set<std::string> source_times_;  // as time_text
  std::vector<std::unique_ptr<const SourceView>> sources_;
  std::map<std::string, std::size_t> left_out_;
};

}  // namespace roslam
