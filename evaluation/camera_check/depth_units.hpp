// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "evaluation/camera_check/contrast.hpp"
#include "evaluation/camera_check/frame_run.hpp"
#include "evaluation/camera_check/lens_fit.hpp"
#include "evaluation/camera_check/tracked_pair.hpp"
#include "roslam/sensors/depth_scale.hpp"

namespace roslam::evaluation {

/// What depth images tell about their scale without any other sensor.
class DepthUnits {
 public:
  /// units_per_metre: of the camera; 0 if depth is not given in units. fx: pixels.
  DepthUnits(double units_per_metre, double fx) : units_per_metre_(units_per_metre), fx_(fx) {}

  /// Adds depth images of a run.
  void add(const FrameRun& run);

  double near() const;  ///< metres; median over images of the depth that 5 % of an image are within
  double median() const;
  double far() const;  ///< 95 %

  /// Share of the depth values that are multiples of five units; 0 without units.
  double multiples_of_five() const;

  const DepthScale& sensor() const { return scale_; }

 private:
  double units_per_metre_;
  double fx_;
  DepthScale scale_;
  std::vector<double> near_, median_, far_;
  std::size_t values_ = 0;
  std::size_t fives_ = 0;
};

/// Length of the motions that depth gives over that of the true ones: how many times depth is too large.
/// Nothing where the truth is missing or moves too little.
std::optional<Contrast> scale_by_truth(const std::vector<TrackedPair>& pairs, const LensFit& fit);

}  // namespace roslam::evaluation
