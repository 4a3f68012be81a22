// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/removal_truth.hpp"
#include "apps/roslam/restoration_pictures.hpp"
#include "roslam/evaluation/map_truth.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

struct MapSequenceSettings {
  std::filesystem::path sequence;    ///< with groundtruth.txt: what roslam simulate or compose wrote
  std::filesystem::path background;  ///< whose pictures show the same without what moves; empty: the sequence
  std::string camera;                ///< a preset or a file; empty: the camera.yaml of the sequence
  std::optional<double> background_depth_units =
      std::nullopt;  ///< a metre; nothing: as a file beside the background says
};

/// A sequence that knows what it looks like without what moves, and where its camera was.
class MapSequence {
 public:
  /// Throws InputError naming what is missing, CalibrationError for an absurd camera.
  explicit MapSequence(const MapSequenceSettings& settings);

  const Camera& camera() const { return camera_; }
  const Trajectory& trajectory() const { return trajectory_; }
  std::size_t size() const { return backgrounds_.size(); }

  /// What is known of a frame; nothing where its pose or the depth of its background is not.
  std::optional<MapTruthFrame> frame(std::size_t index) const;

 private:
  void add_taken(MapTruthFrame& frame, const std::string& time) const;

  Trajectory trajectory_;
  Camera camera_;
  std::vector<SequencePicture> backgrounds_;
  std::map<std::string, SequencePicture> pictures_;  // of the sequence, by time
  std::map<std::string, SequencePicture> taken_;     // that tell the depth of what moves, by time
  std::optional<MovingTruthFolder> moving_;
  double background_units_ = 0.0;
  double taken_units_ = 0.0;
};

}  // namespace roslam::app
