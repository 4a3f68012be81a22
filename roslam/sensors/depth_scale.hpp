// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace roslam {

/// Estimates from the depth images of a triangulating sensor (stereo, structured light) whether their scale
/// is plausible. Such a sensor measures disparity in steps, so that its depth has steps of k z^2 metres with
/// k = step / (focal length * baseline), and it sees no depth in the shadow beside a near surface, whose
/// width is focal length * baseline * (1 / z_near - 1 / z_far) pixels. If depth is given s times too large, k
/// appears s times smaller and the baseline s times larger: their ratio grows with s squared. Sensors without
/// such steps, such as those that measure time of flight, give no estimate.
class DepthScale {
 public:
  /// Adds an image. depth: CV_32FC1, metres; a few rows are looked at. fx: pixels.
  void add(const cv::Mat& depth, double fx);

  /// Baseline in metres that shadows show, where it is implausibly large for the steps of depth; nothing
  /// otherwise or while there are too few data.
  std::optional<double> implausible_baseline() const;

  /// Baseline in metres that the shadows show; nothing where there are too few.
  std::optional<double> baseline() const;

  /// k * fx in 1/metre, by the steps of depth, which is the step of disparity over the baseline; nothing
  /// unless they grow with the square of depth.
  std::optional<double> step_factor() const;

 private:
  static constexpr std::size_t kBands = 32;  // of depth

  void add_row(const float* row, int size);

  double fx_ = 0.0;
  std::size_t images_ = 0;
  std::array<std::vector<float>, kBands> depths_;
  std::array<std::vector<float>, 2> baselines_;  // by the side of the near surface
};

}  // namespace roslam
