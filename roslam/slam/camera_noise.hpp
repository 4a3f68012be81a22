// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "roslam/estimation/estimation_options.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/sensors/depth_noise_estimator.hpp"
#include "roslam/tracking/tracked_frame.hpp"

namespace roslam {

/// The noise of a camera as it shows while its pose is tracked: of depth, from images of the same surfaces,
/// and of the pixels of features, from the errors of their matches with the map. Not thread safe.
class CameraNoise {
 public:
  CameraNoise(const Camera& camera, const MeasurementNoise& assumed)
      : assumed_(assumed),
        pixel_sigma_(assumed.pixel_sigma),
        of_camera_(camera.depth_noise),
        depth_(camera) {}

  /// Writes the noise of its features into a frame, as it is known by now.
  void note_in(ObservedFrame& view) const;

  /// Adds a tracked frame. depth: CV_32FC1 metres; excluded: empty, or CV_8UC1, nonzero where things move.
  void add(const TrackedFrame& frame, const cv::Mat& depth, const cv::Mat& excluded);

  /// To be called when the poses before and after have nothing in common.
  void interrupt() { depth_.interrupt(); }

  /// Of smooth surfaces: estimated, or else of the camera; nothing if neither is known.
  std::optional<DepthNoise> depth() const;

  /// That of features, as now written into frames.
  MeasurementNoise of_features() const;

 private:
  MeasurementNoise assumed_;
  double pixel_sigma_;
  std::optional<DepthNoise> of_camera_;
  DepthNoiseEstimator depth_;
};

}  // namespace roslam
