// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/camera_noise.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

std::optional<DepthNoise> CameraNoise::depth() const {
  if (!assumed_.estimate) return std::nullopt;
  const auto estimated = depth_.estimate();
  return estimated ? estimated : of_camera_;
}

MeasurementNoise CameraNoise::of_features() const {
  if (!assumed_.estimate) return assumed_;
  // Features lie on edges, where depth is poorer than on the smooth surfaces that the estimate is from.
  constexpr double kAtFeatures = 1.7;
  auto noise = depth();
  if (noise) *noise = {kAtFeatures * noise->constant, kAtFeatures * noise->growth};
  return assumed_.known_of(pixel_sigma_, noise);
}

void CameraNoise::note_in(ObservedFrame& view) const {
  const MeasurementNoise noise = of_features();
  view.pixel_sigma = noise.pixel_sigma;
  view.depth_noise = noise.depth_noise();
}

void CameraNoise::add(const TrackedFrame& frame, const cv::Mat& depth, const cv::Mat& excluded) {
  if (!assumed_.estimate || frame.state != TrackingState::kTracking) return;
  depth_.add(depth, excluded, *frame.T_camera_world, frame.timestamp);
  constexpr int kEnough = 50;     // inliers
  constexpr double kRate = 0.05;  // a frame's part of the estimate
  constexpr double kRange = 3.0;  // factor by which the estimate may differ from what is assumed
  if (frame.inliers < kEnough || !(frame.pixel_error_scale > 0.0)) return;
  pixel_sigma_ *= std::pow(frame.pixel_error_scale, kRate);
  pixel_sigma_ = std::clamp(pixel_sigma_, assumed_.pixel_sigma / kRange, assumed_.pixel_sigma * kRange);
}

}  // namespace roslam
