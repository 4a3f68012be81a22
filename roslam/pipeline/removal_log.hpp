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
#include <thread>

#include "roslam/picture_strip.hpp"
#include "roslam/pipeline/removal_record.hpp"
#include "roslam/pipeline/slam.hpp"

namespace roslam {

/// Writes what was removed from each frame, while the run goes on, on a thread of its own: descriptors.jsonl,
/// the masks, a strip of pictures and, if wanted, a video. Of more frames than it can write it drops the
/// masks, and counts them, rather than to make the tracker wait; in deterministic mode it makes it wait.
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

  /// Removes what a run before left in a folder.
  static void remove_old(const std::filesystem::path& folder);

  RemovalLog(const RemovalLog&) = delete;
  RemovalLog& operator=(const RemovalLog&) = delete;

  void add(const Frame& frame, const FrameResult& result);

  /// Writes the rest and the strip. Throws OutputError if anything could not be written; then nothing of the
  /// log stays, to leave room for the results of the run.
  void finish();

  /// Only after finish().
  const RemovalTally& tally() const { return tally_; }

 private:
  struct Entry {
    cv::Mat colour;  // empty: no picture is wanted
    FrameResult result;
    cv::Size picture;
    bool in_strip = false;
    bool with_mask = true;
  };

  void work();
  void write(const Entry& entry);
  void write_picture(const Entry& entry);

  Settings settings_;
  RemovalTally tally_;

  PictureStrip strip_;  // pictures are added by the writing thread
  std::ofstream lines_;
  cv::VideoWriter video_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;
  bool is_closed_ = false;
  std::exception_ptr failure_;
  std::jthread thread_;  // last, so that it stops before what it uses goes away
};

}  // namespace roslam
