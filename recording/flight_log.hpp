// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "roslam/common/appended_file.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam::recording {

/// Saves what a run has found while it goes on, so that a program that is killed loses a second at most:
/// odometry.csv and trajectory.txt grow with each frame, and the map is saved from time to time; the
/// trajectory is then written anew, as the map has been corrected. On threads of its own: add() never waits
/// for the disk. add() and finish() are called from one thread.
class FlightLog {
 public:
  struct Settings {
    std::filesystem::path folder;
    double checkpoint = 30.0;  ///< seconds between two saved maps; 0: none is saved
    bool saves_map = true;     ///< false where the map is only used
    bool saves_dense = false;  ///< dense.ply as well, as of the checkpoint before
  };

  /// A file that cannot be made is a fault, and what it lacks is told by finish(). slam must outlive the log.
  FlightLog(const Settings& settings, const Slam& slam);
  ~FlightLog();
  FlightLog(const FlightLog&) = delete;
  FlightLog& operator=(const FlightLog&) = delete;

  void add(const FrameResult& result);

  /// Writes what was added so far at once. May be called from any thread.
  void flush();

  /// Saves the trajectory and the map at once, as at a checkpoint. May be called from any thread.
  void save();

  /// Ends the thread: from now on the trajectory and the map are for the caller to write.
  void stop();

  /// Writes the rest of odometry.csv, after stop(). Throws OutputError if lines are missing.
  void finish();

  /// What could not be saved while the run went on, by message, and how often.
  std::map<std::string, std::size_t> faults() const;

 private:
  void work(const std::stop_token& stop);
  void append();
  void save_path();
  void save_map_file();
  void save_dense_map();
  template <typename Step>
  void attempt(const Step& step);

  Settings settings_;
  const Slam& slam_;
  std::optional<AppendedFile> odometry_;    // nothing: it could not be made
  std::optional<AppendedFile> trajectory_;  // likewise
  mutable std::mutex mutex_;
  std::condition_variable_any tick_;
  std::string odometry_lines_;      // not yet written
  Trajectory poses_;                // likewise, of trajectory.txt
  std::optional<SubmapId> submap_;  // that trajectory.txt is of
  bool wants_flush_ = false;
  bool wants_save_ = false;
  bool is_path_old_ = false;  // poses in it were withdrawn, or are of another submap
  std::map<std::string, std::size_t> faults_;
  std::jthread thread_;  // last, so that it ends before the members it uses are destroyed
};

}  // namespace roslam::recording
