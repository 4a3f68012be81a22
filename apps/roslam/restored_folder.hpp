// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <set>
#include <string>

#include "apps/roslam/tum_writer.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/restoration/restoration_picture.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam::app {

/// The method in restoration.json of keyframes that were restored in flight.
inline constexpr const char* kInFlight = "in flight";

/// A sequence without its moving things in the TUM format, and beside it where each pixel comes from.
class RestoredFolder {
 public:
  /// Replaces what an earlier restoration left there. Throws OutputError if the folder is not usable or
  /// cannot be made.
  RestoredFolder(std::filesystem::path folder, const Camera& camera);

  /// Throws OutputError if a folder holds pictures of other origin or a run.
  static void require_usable(const std::filesystem::path& folder);

  /// Removes what `run --restore` left in an earlier run, so that it does not pass for the result of a later
  /// one. Throws OutputError.
  static void remove_old(const std::filesystem::path& folder);

  /// Throws OutputError if frames of a source lie in what the folder's files would replace.
  static void require_apart(const std::filesystem::path& folder, const std::filesystem::path& source);

  /// name: of the frame's files, without ending; of a name that was there before the time is taken. Throws
  /// OutputError.
  void add(const Frame& frame, const RestoredView& restored, const std::string& name);

  /// Writes what is still held back and, if there are any, pictures of before and after. report: the contents
  /// of restoration.json, by which the folder is known for ours. Throws OutputError.
  void close(const std::string& report);

  std::size_t frames() const { return frames_; }

  /// Pixels so far, by what became of them.
  std::size_t measured() const { return pixels_ - reprojected_ - invented_; }
  std::size_t reprojected() const { return reprojected_; }
  std::size_t invented() const { return invented_; }

 private:
  std::filesystem::path folder_;
  Camera camera_;
  TextFile colours_, depths_;
  std::set<std::string> names_;
  bool has_depth_ = false;
  std::size_t frames_ = 0;
  std::size_t pixels_ = 0, reprojected_ = 0, invented_ = 0;
  RestorationStrip pictures_;
};

}  // namespace roslam::app
