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

/// A text file that is written line by line and checked after each. All members throw OutputError if the file
/// cannot be written.
class TextFile {
 public:
  explicit TextFile(std::filesystem::path file);
  void line(const std::string& text);

  /// Flushes and closes the file.
  void close();

 private:
  void check() const;

  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace roslam::app
