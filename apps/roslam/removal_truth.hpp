// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "apps/roslam/sources.hpp"
#include "roslam/evaluation/removal_error.hpp"

namespace roslam::app {

/// A frame of a source that knows what moves in it.
struct RemovalTruthFrame {
  double timestamp = 0.0;            ///< seconds
  cv::Mat colour;                    ///< CV_8UC3, BGR
  std::optional<MovingTruth> truth;  ///< nothing: its image is missing or unusable
};

/// Gives the frames of a source with what really moves in them, in the order of time.
class RemovalTruth {
 public:
  RemovalTruth() = default;
  RemovalTruth(const RemovalTruth&) = delete;
  RemovalTruth& operator=(const RemovalTruth&) = delete;
  virtual ~RemovalTruth() = default;

  /// The next frame, or nothing at the end.
  virtual std::optional<RemovalTruthFrame> next() = 0;

  /// Number of frames, those that cannot be read included.
  virtual std::size_t size() const = 0;

  /// Frames that could not be read so far, by reason in words.
  virtual std::map<std::string, std::size_t> skipped() const { return {}; }
};

/// What a TUM folder knows of what moves in its frames. It may hold images named as those of colour, as PNG:
///  - instances/, 16 bit: nonzero on what really moves; labels/ then tells by class what can move but rests.
///  - labels/ alone, 8 bit: numbers of actors, if most pixels are 0 and 255 does not occur or nothing but it;
///    else classes (Cityscapes train ids, 255 = none), of which all that can move are taken to move.
/// Labels with a labels.json, as `roslam segment` writes it, are estimates and not used.
class MovingTruthFolder {
 public:
  /// Nothing if the folder knows nothing.
  static std::optional<MovingTruthFolder> open(const std::filesystem::path& folder);

  /// name: of the colour image, without ending. Nothing if the images are missing, unusable or do not fit
  /// each other.
  std::optional<MovingTruth> read(const std::string& name) const;

 private:
  MovingTruthFolder() = default;

  std::filesystem::path instances_;  // empty: there are none
  std::filesystem::path labels_;
  bool labels_are_classes_ = true;
};

/// Opens the truth of a source; null if nothing is known of what moves in it. A simulated flight knows all,
/// a recording what MovingTruthFolder finds. Throws InputError or CalibrationError as open_source does.
std::unique_ptr<RemovalTruth> open_removal_truth(const SourceArguments& arguments);

}  // namespace roslam::app
