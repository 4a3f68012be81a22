// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/evaluate/removal_truth.hpp"
#include "apps/roslam/evaluate/restoration_images.hpp"
#include "evaluation/map_truth.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::app {

struct MapSequenceSettings {
  std::filesystem::path sequence;    ///< with groundtruth.txt: a folder of roslam simulate or compose
  std::filesystem::path background;  ///< the same images without dynamic objects; empty: of the sequence
  std::string camera;                ///< a preset or a file; empty: the camera.yaml of the sequence
  std::optional<double> background_depth_units =
      std::nullopt;  ///< per metre; nothing: as stated beside the background
};

/// A sequence with true camera poses and images of its static background.
class MapSequence {
 public:
  /// Throws InputError naming what is missing, CalibrationError for an invalid camera.
  explicit MapSequence(const MapSequenceSettings& settings);

  const Camera& camera() const { return camera_; }
  const Trajectory& trajectory() const { return trajectory_; }
  std::size_t size() const { return backgrounds_.size(); }

  /// The truth of a frame; nothing if its pose or the depth of its background is not known.
  std::optional<evaluation::MapTruthFrame> frame(std::size_t index) const;

 private:
  void add_taken(evaluation::MapTruthFrame& frame, const std::string& time) const;

  Trajectory trajectory_;
  Camera camera_;
  std::vector<SequenceImage> backgrounds_;
  std::map<std::string, SequenceImage> images_;  // of the sequence, by time
  std::map<std::string, SequenceImage> taken_;   // that give the depth of moving objects, by time
  std::optional<MovingTruthFolder> moving_;
  double background_units_ = 0.0;
  double taken_units_ = 0.0;
};

}  // namespace roslam::app
