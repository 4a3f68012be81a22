// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "roslam/evaluation/removal_error.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/restoration/removed_region.hpp"

namespace roslam {

/// What a run wrote down of one frame's removal.
struct RecordedFrame {
  std::filesystem::path mask;          ///< as object_image() makes it; empty if there is none
  bool has_objects = false;            ///< things were removed; without a mask, it was dropped
  std::set<std::size_t> resting;       ///< values in the mask of things that the run took to be at rest
  std::vector<RemovedRegion> regions;  ///< of the auxiliary descriptor, one for each thing
  CountedPoints points;
};

/// What a run removed, read back from the folder that `roslam run` wrote.
class RecordedRemoval {
 public:
  /// Throws InputError naming the file that is missing or damaged, in run.json or descriptors.jsonl.
  explicit RecordedRemoval(const std::filesystem::path& run_folder);

  /// In effect in the run.
  const Options& options() const { return options_; }

  /// False for a run with --dynamic none: it tells nothing of its frames, none of which had a mask.
  bool has_frames() const { return options_.removal.is_on(); }

  /// Of the frame of that time; null if the run did not process it.
  const RecordedFrame* find(double timestamp) const;

 private:
  std::filesystem::path folder_;
  Options options_;
  std::map<std::string, RecordedFrame> frames_;  // by the name that the mask of their time has
};

}  // namespace roslam
