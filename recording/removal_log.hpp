// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <thread>

#include "recording/image_strip.hpp"
#include "recording/removal_record.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam::recording {

/// Writes the dynamic objects of each frame during the run, on a thread of its own: descriptors.jsonl, masks,
/// a strip of images and optionally a video. In real-time mode add() never blocks: if the queue is full it
/// keeps only the frame's line, later not even that, and counts what it drops. In deterministic mode it
/// blocks. add() and finish() are called from one thread.
class RemovalLog {
 public:
  struct Settings {
    std::filesystem::path folder;
    Mode mode = Mode::kDeterministic;
    double fps = 30.0;        ///< of the video, frames a second
    bool with_video = false;  ///< removal.avi as well
  };

  /// Throws OutputError if the files cannot be made.
  explicit RemovalLog(const Settings& settings);
  ~RemovalLog();

  /// Removes the files of an earlier run from a folder.
  static void remove_old(const std::filesystem::path& folder);

  RemovalLog(const RemovalLog&) = delete;
  RemovalLog& operator=(const RemovalLog&) = delete;

  void add(const Frame& frame, const FrameResult& result);

  /// Writes the queue and the strip. Throws OutputError if anything could not be written; then all files of
  /// the log are removed, to leave disk space for the results of the run.
  void finish();

  /// Only after finish().
  const RemovalTally& tally() const { return tally_; }

 private:
  struct Entry {
    cv::Mat colour;  // empty: no image is wanted
    FrameResult result;
    cv::Size image;
    bool in_strip = false;
    std::string line = {};  // not empty: all that is kept of the frame, with its tally
    RemovalTally tally = {};
  };

  void work();
  void write(const Entry& entry);
  static void keep_line_only(Entry& entry);
  void write_line(const std::string& line);
  void add_to_images(const Entry& entry);

  Settings settings_;
  RemovalTally tally_;

  ImageStrip strip_;  // images are added by the writing thread
  std::ofstream lines_;
  cv::VideoWriter video_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;
  bool is_closed_ = false;
  std::size_t lines_dropped_ = 0;
  std::exception_ptr failure_;
  std::jthread thread_;  // last, so that it ends before the members it uses are destroyed
};

}  // namespace roslam::recording
