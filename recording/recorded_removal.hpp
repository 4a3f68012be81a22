// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "evaluation/removal_error.hpp"
#include "roslam/options/options.hpp"
#include "roslam/restoration/removed_region.hpp"

namespace roslam::recording {

/// The recorded dynamic objects of one frame.
struct RecordedFrame {
  std::filesystem::path mask;          ///< file, as object_image() writes it; empty: none
  bool has_objects = false;            ///< objects were removed; without a mask it was dropped
  std::set<std::size_t> resting;       ///< mask values of objects classified as at rest
  std::vector<RemovedRegion> regions;  ///< of the auxiliary descriptor, one for each object
  evaluation::CountedPoints points;
};

/// The dynamic objects a run removed, read from the folder that `roslam run` wrote.
class RecordedRemoval {
 public:
  /// Reads run.json and descriptors.jsonl. Throws InputError naming the file that is missing or damaged.
  explicit RecordedRemoval(const std::filesystem::path& run_folder);

  /// The options of the run.
  const Options& options() const { return options_; }

  /// False for a run with --dynamic none, which records no frames.
  bool has_frames() const { return options_.dynamic_objects.is_on(); }

  /// The frame of that timestamp (seconds); null if the run did not process it.
  const RecordedFrame* find(double timestamp) const;

 private:
  std::filesystem::path folder_;
  Options options_;
  std::map<std::string, RecordedFrame> frames_;  // by mask_name() of their timestamp
};

}  // namespace roslam::recording
