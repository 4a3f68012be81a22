// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/core/mat.hpp>
#include <string>

#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

/// Depth in metres (CV_32FC1, 0 = unknown) as CV_16UC1. Values beyond 16 bits become 0 (unknown).
cv::Mat packed_depth(const cv::Mat& depth, double units_per_metre);

/// A text file that is written line by line, to a temporary file (.part) that close() renames: it is there in
/// whole or not at all. A device or pipe is written directly. All members throw OutputError if the file
/// cannot be written.
class TextFile {
 public:
  /// Removes an old file, as a list of images that are about to be replaced.
  explicit TextFile(std::filesystem::path file);
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  ~TextFile();

  void line(const std::string& text);

  /// Flushes, closes and renames the file.
  void close();

 private:
  void check() const;

  std::filesystem::path file_;
  std::filesystem::path part_;  // file_ itself for a device
  std::ofstream stream_;
  bool is_whole_ = false;
};

}  // namespace roslam::app
