// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "recording/output_folder.hpp"
#include "recording/removal_record.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "telemetry/mavlink/mavlink_report.hpp"

namespace roslam::recording {

/// Results of a run: the summary of run() and what was recorded beside it.
struct RunResults : RunSummary {
  double start_up_seconds = -1.0;  ///< from the start of the process to the first pose; negative = no pose
  std::map<std::string, std::size_t> saving_faults;  ///< what could not be saved during the run, by message
  std::optional<RemovalTally> removal;               ///< what was removed, where a RemovalLog was kept
  std::optional<DenseMap> dense;                     ///< of Slam::dense_map(), if it was called
  std::optional<telemetry::MavlinkReport> mavlink;   ///< what an autopilot was sent, with --mavlink
};

/// The inputs of a run, for its report.
struct RunDescription {
  std::string source;                         ///< as the user named it
  std::string camera;                         ///< as the user named it
  std::string version;                        ///< of the program
  std::string segmentation_model;             ///< weights file of the segmentation network; empty: not used
  std::string map;                            ///< file of the loaded map; empty: none
  std::map<std::string, std::string> flight;  ///< options of a simulated flight by name; empty: a recording
  bool resumes = false;                       ///< goes on with the run in the folder
  std::string id;                             ///< of the run; RunFolder::begin() makes one
};

/// What became of the frames of a source.
struct FrameCounts {
  std::size_t in_source = 0;  ///< that the source holds, whatever became of them
  std::size_t processed = 0;
  std::size_t with_pose = 0;                   ///< in trajectory.txt
  std::size_t dropped = 0;                     ///< the tracker was too busy for
  std::map<std::string, std::size_t> skipped;  ///< by source and pipeline, by reason in words

  std::size_t all_skipped() const;
  double pose_share() const;  ///< of the frames in the source, 0 to 1
  bool is_complete() const { return with_pose == in_source; }

  /// One line: frames with a pose of those in the source, and what became of the others.
  std::string in_words() const;
};

/// Writes the results of a run to a folder:
///   trajectory.txt  poses of all tracked frames (TUM format)
///   keyframes.txt   poses of the keyframes (TUM format)
///   map.ply         landmarks with colour
///   dense.ply       the dense map, points and triangles, if one was built
///   dense.bt        its free and occupied space, for planners (OctoMap)
///   map.roslam      the map, for later runs; an old one is kept if there is no new map
///   trajectory.png  the trajectory from above
///   groundtruth.txt the true poses, if the source has them (TUM format)
///   run.json        effective options, counts, times of every stage, memory
///   report.html     figures and tables: trajectory, errors, times, images
/// Results of an earlier run are moved to the subfolder previous/ when a run begins, so that they do not pass
/// for those of a run that is killed; those of a run that is resumed to sessions/1, 2 and so on, and stay.
/// The folder is locked meanwhile.
class RunFolder {
 public:
  /// Creates and locks the folder. Throws OutputError, before any work is lost, if it is not writable, is a
  /// dataset, is in use by another run, or, unless overwrite, holds files of these names that no run wrote.
  explicit RunFolder(const std::filesystem::path& path, bool overwrite = false);

  /// Moves the results of an earlier run away, gives the new run an id and writes a run.json that says that
  /// it is not finished. A map.roslam that the run continues stays. Throws OutputError.
  void begin(RunDescription& description, const Camera& camera) const;

  /// Writes trajectory, keyframes and map, the results that matter most, before those that take longer.
  /// Throws as write() does.
  void write_flight(const Slam& slam) const;

  /// Writes all other results, also of a run that was interrupted or failed. Continues after a file that
  /// cannot be written and throws the first failure as OutputError at the end. is_urgent: polled between
  /// files; once true, only run.json and groundtruth.txt are written.
  void write(const Slam& slam, const RunResults& summary, const FrameSource& source,
             const RunDescription& description, const std::function<bool()>& is_urgent = {}) const;

  const std::filesystem::path& path() const { return path_; }

 private:
  enum class Result;
  struct Output;
  static Result if_any(bool is_any, Result otherwise);
  static void write_one(const Output& output, const std::filesystem::path& file);
  void write_all(const std::vector<Output>& outputs, const std::function<bool()>& is_urgent = {}) const;

  std::filesystem::path path_;
  FolderLock lock_;
};

FrameCounts count_frames(const Slam& slam, const RunResults& summary, const FrameSource& source);

/// Frames that the pipeline did not use, by reason in words.
std::map<std::string, std::size_t> rejected_by_reason(const Slam& slam);

/// The contents of run.json of a run that has begun: what it is, and that it is not finished.
std::string unfinished_report(const RunDescription& description, const Camera& camera);

/// The contents of run.json.
std::string run_report(const Slam& slam, const RunResults& summary, const FrameSource& source,
                       const RunDescription& description);

/// The contents of report.html. folder: of the run's images.
std::string run_page(const Slam& slam, const RunResults& summary, const FrameSource& source,
                     const RunDescription& description, const std::filesystem::path& folder);

}  // namespace roslam::recording
