// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "recording/frame_poses.hpp"
#include "recording/run_contents.hpp"
#include "recording/topic_file.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::recording {

struct McapExportOptions {
  int jpeg_quality = 85;  ///< of images, 1 to 100

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Writes a run to an MCAP file with messages of ROS 2, for viewers (docs/export.md): maps and what does not
/// change at the beginning, poses and images in the order of time. For one thread at a time.
class McapExport {
 public:
  /// Throws OutputError.
  McapExport(const std::filesystem::path& file, RunContents run, const McapExportOptions& options = {});

  /// Writes the image of a frame of the run's source, and all poses up to it. Throws OutputError, and
  /// InputError for an image that is not of the size of the run's camera.
  void add(const Frame& frame);

  /// Writes the poses after the last image and puts the file in its place. Without this call nothing is left
  /// of it. Throws OutputError.
  void finish();

  const TopicFile& file() const { return file_; }
  /// What was left out and how often, in words.
  const std::map<std::string, std::size_t>& left_out() const { return left_out_; }

 private:
  void begin(std::int64_t stamp);
  void write_truth(std::int64_t stamp, std::vector<RosTransform>& fixed);
  void write_poses(const FramePoses& poses);
  void write_path(std::int64_t stamp);
  void write_removed(const RosHeader& header, const Frame& frame);

  RunContents run_;
  McapExportOptions options_;
  std::vector<FramePoses> poses_;
  TopicFile file_;
  bool has_begun_ = false;
  std::size_t next_ = 0;                         // of poses_
  std::size_t path_length_ = 0;                  // poses of the path so far
  std::int64_t path_interval_ = 0;               // ns between two messages of the path
  std::optional<std::int64_t> path_stamp_ = {};  // of the last one
  std::map<std::string, std::size_t> left_out_;
};

}  // namespace roslam::recording
