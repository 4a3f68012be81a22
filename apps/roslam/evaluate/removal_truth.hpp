// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "apps/roslam/support/sources.hpp"
#include "evaluation/removal_error.hpp"

namespace roslam::app {

/// A frame with the true dynamic objects.
struct RemovalTruthFrame {
  double timestamp = 0.0;                        ///< seconds
  cv::Mat colour;                                ///< CV_8UC3, BGR
  std::optional<evaluation::MovingTruth> truth;  ///< nothing if its image is missing or unusable
};

/// Gives the frames of a source with their true dynamic objects, in the order of time.
class RemovalTruth {
 public:
  RemovalTruth() = default;
  RemovalTruth(const RemovalTruth&) = delete;
  RemovalTruth& operator=(const RemovalTruth&) = delete;
  virtual ~RemovalTruth() = default;

  /// The next frame, or nothing at the end.
  virtual std::optional<RemovalTruthFrame> next() = 0;

  /// Number of frames, including those that cannot be read.
  virtual std::size_t size() const = 0;

  /// Frames that could not be read so far, by reason in words.
  virtual std::map<std::string, std::size_t> skipped() const { return {}; }
};

/// The true dynamic objects of a TUM RGB-D folder, from PNG images with the names of the colour images:
///  - instances/, 16 bit: nonzero on actors, the objects that move; labels/ beside it gives the classes, by
///    which other movable objects are at rest.
///  - labels/ alone, 8 bit: numbers of actors if most pixels are 0 and all or none of the others 255; else
///    classes (Cityscapes train ids, 255 = none), of which all movable ones count as actors.
/// Labels with a labels.json, as `roslam segment` writes it, are estimates and not used.
class MovingTruthFolder {
 public:
  /// Nothing if the folder has no such images.
  static std::optional<MovingTruthFolder> open(const std::filesystem::path& folder);

  /// name: of the colour image, without extension. Nothing if the images are missing, unusable or differ in
  /// size.
  std::optional<evaluation::MovingTruth> read(const std::string& name) const;

 private:
  MovingTruthFolder() = default;

  std::filesystem::path instances_;  // empty: there are none
  std::filesystem::path labels_;
  bool labels_are_classes_ = true;
};

/// Opens the truth of a source: of a simulated flight, or what MovingTruthFolder finds in a recording; null
/// if there is none. Throws InputError or CalibrationError as open_source() does.
std::unique_ptr<RemovalTruth> open_removal_truth(const SourceArguments& arguments);

}  // namespace roslam::app
