// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <set>
#include <string>

#include "apps/roslam/support/tum_writer.hpp"
#include "recording/restoration_image.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::app {

/// The method in restoration.json of keyframes that were restored in flight.
inline constexpr const char* kInFlight = "in flight";

/// Writes a restored sequence in TUM RGB-D format, with an image of the provenance of each pixel.
class RestoredFolder {
 public:
  /// Removes the results of an earlier restoration. Throws OutputError if the folder is not usable or cannot
  /// be created.
  RestoredFolder(std::filesystem::path folder, const Camera& camera);

  /// Throws OutputError if a folder holds a dataset or a run.
  static void require_usable(const std::filesystem::path& folder);

  /// Removes the results of an earlier `roslam run --restore`, so that they are not taken for those of a
  /// later run. Throws OutputError.
  static void remove_old(const std::filesystem::path& folder);

  /// Throws OutputError if the folder's files would overwrite frames of the source.
  static void require_apart(const std::filesystem::path& folder, const std::filesystem::path& source);

  /// name: of the frame's files, without extension; a name that occurred before is replaced by the timestamp.
  /// Throws OutputError.
  void add(const Frame& frame, const RestoredImage& restored, const std::string& name);

  /// Flushes the lists and writes before_after.jpg. report: the contents of restoration.json, by which
  /// require_usable() recognises the folder. Throws OutputError.
  void close(const std::string& report);

  std::size_t frames() const { return frames_; }

  /// Pixels so far, by provenance.
  std::size_t measured() const { return pixels_ - reprojected_ - inpainted_; }
  std::size_t reprojected() const { return reprojected_; }
  std::size_t inpainted() const { return inpainted_; }

 private:
  std::filesystem::path folder_;
  Camera camera_;
  TextFile colours_, depths_;
  std::set<std::string> names_;
  bool has_depth_ = false;
  std::size_t frames_ = 0;
  std::size_t pixels_ = 0, reprojected_ = 0, inpainted_ = 0;
  recording::RestorationStrip images_;
};

}  // namespace roslam::app
