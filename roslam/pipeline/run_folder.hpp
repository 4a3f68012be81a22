// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "roslam/pipeline/run.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam {

/// What a run was asked to do, for its report.
struct RunDescription {
  std::string source;   ///< as the user named it
  std::string camera;   ///< as the user named it
  std::string version;  ///< of the program
  std::string
      segmentation_model;  ///< file of the network that labelled the frames; empty: nothing was removed
  std::string map;         ///< file of the map the flight went on from; empty: none
  std::map<std::string, std::string> flight;  ///< options of a simulated flight by name; empty: a recording
};

/// Where the results of a run go:
///   trajectory.txt  poses of all tracked frames (TUM format)
///   keyframes.txt   poses of the keyframes (TUM format)
///   map.ply         landmarks with colour
///   dense.ply       the dense map, points and triangles, where one was made
///   dense.bt        free and occupied space by it, for planners (OctoMap)
///   map.roslam      the map, for another flight; kept where there is no new one
///   trajectory.png  the way flown, seen from above
///   groundtruth.txt the true poses, where the source knows them (TUM format)
///   run.json        effective options, counts, times of every stage, memory
///   report.html     the run to look at: path, errors, times, pictures
class RunFolder {
 public:
  /// Creates the folder. Throws OutputError at once, before any work is lost, if nothing can be written there
  /// or if the folder is a dataset.
  explicit RunFolder(const std::filesystem::path& path);

  /// Writes trajectory, keyframes and map, which nobody can do again: before what takes longer. Throws as
  /// write() does.
  void write_flight(const Slam& slam) const;

  /// Writes all other results, also those of a run that was interrupted or failed. What cannot be written
  /// does not keep the others from being written; the first failure is thrown as OutputError at the end.
  void write(const Slam& slam, const RunSummary& summary, const FrameSource& source,
             const RunDescription& description) const;

  const std::filesystem::path& path() const { return path_; }

 private:
  enum class Result;
  struct Output;
  static Result if_any(bool is_any, Result otherwise);
  static void write_one(const Output& output, const std::filesystem::path& file);
  void write_all(const std::vector<Output>& outputs) const;

  std::filesystem::path path_;
};

/// The contents of run.json.
std::string run_report(const Slam& slam, const RunSummary& summary, const FrameSource& source,
                       const RunDescription& description);

/// The contents of report.html. folder: where the run's pictures are.
std::string run_page(const Slam& slam, const RunSummary& summary, const RunDescription& description,
                     const std::filesystem::path& folder);

}  // namespace roslam
