// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/mapping/mapping_options.hpp"

namespace roslam {

/// Removes new landmarks that are seldom found where they are predicted, or seen by too few keyframes
/// (Mur-Artal et al., T-RO 2015, section VI).
class LandmarkCuller {
 public:
  explicit LandmarkCuller(const CullingOptions& options) : options_(options) {}

  void watch(const std::vector<LandmarkId>& landmarks);

  /// To be called once per keyframe. Returns how many were removed.
  int cull(Map& map, KeyframeId newest);

 private:
  CullingOptions options_;
  std::deque<LandmarkId> watched_;
};

/// The images of a frame that landmarks are checked against, as taken (distorted).
struct Contradiction {
  const cv::Mat& moving;  ///< CV_8UC1, nonzero on moving objects; may be empty
  const cv::Mat& depth;   ///< CV_32FC1, metres, 0 = unknown; may be empty
};

/// Removes those of the landmarks that several frames saw on a moving object, or saw through: they were on
/// something that moved. Returns how many. Frames without depth at a landmark do not count.
int cull_contradicted(Map& map, const std::vector<LandmarkId>& landmarks, const Camera& camera,
                      const SE3& T_camera_world, const Contradiction& frame, const MeasurementNoise& noise);

/// Removes redundant keyframes covisible with the newest: nearly all their landmarks are seen by enough
/// others at a similar or finer level. The first keyframe of a submap stays. Returns how many were removed.
int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options);

}  // namespace roslam
