// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::benchmarks {

/// The start of a simulated flight along an empty street, rendered on first use, so that a benchmark that is
/// filtered out costs nothing, and kept, since Google Benchmark calls a benchmark several times.
class RenderedFlight {
 public:
  explicit RenderedFlight(std::size_t frames) : wanted_(frames) {}

  const std::vector<Frame>& frames();
  const Camera& camera();

 private:
  void render();

  std::size_t wanted_;
  std::vector<Frame> frames_;
  Camera camera_;
};

/// The camera of all scenes in this file: 640 x 480 without distortion.
Camera synthetic_camera();

/// Features with random pixels, depths and descriptors, as the extractor gives them.
ObservedFrame random_frame(std::size_t points, std::mt19937& random);

/// The same features in another order, each with some bits of its descriptor flipped.
ObservedFrame seen_again(const ObservedFrame& frame, int flipped_bits, std::mt19937& random);

struct PoseScene {
  std::vector<PoseMeasurement> measurements;
  SE3 true_T_camera_world;
  SE3 initial_T_camera_world;
};

/// Points in front of a camera whose initial pose is off by a few centimetres; the given share are outliers.
PoseScene make_pose_scene(std::size_t measurements, double outlier_share, std::mt19937& random);

struct BundleSize {
  std::size_t poses = 10;
  std::size_t points = 1000;
  std::size_t observations_each = 5;  ///< of a point; at most `poses`
};

/// A camera that moves sideways past a wall of points; all but the first pose, and all points, are perturbed.
BundleProblem make_bundle(const BundleSize& size, std::mt19937& random);

}  // namespace roslam::benchmarks
