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

struct SequenceRestorerOptions {
  int margin = 8;                ///< pixels by which what was removed is dilated: outlines are blurred
  double source_interval = 0.5;  ///< seconds; beside keyframes, a frame is kept to fill others from as often
  int max_sources = 200;         ///< frames kept; of more, which take 2.5 MB each at 640x480, every n-th

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Restores the frames of a recorded run, from all of it: from what the camera saw before and after.
class SequenceRestorer {
 public:
  /// Throws OptionsError. run and restorer must outlive it.
  SequenceRestorer(const RecordedRun& run, StaticSceneRestorer& restorer,
                   const SequenceRestorerOptions& options = {});

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
  SequenceRestorerOptions options_;
  std::set<long long> source_times_;  // microseconds
  std::vector<std::unique_ptr<const SourceView>> sources_;
  std::map<std::string, std::size_t> left_out_;
};

}  // namespace roslam
