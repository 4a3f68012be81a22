// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

struct CullingOptions {
  double min_found_ratio = 0.25;  ///< share of the frames that should have seen a new landmark that must have
  int probation = 3;              ///< keyframes a landmark is watched for
  int min_observations = 3;       ///< keyframes that must see it once its probation ends (2 while it lasts)
  double redundant_share = 0.9;   ///< share of a keyframe's landmarks others see as well for it to go
  int redundant_views = 3;        ///< other keyframes that must see each of them
  int keep_newest = 3;            ///< newest keyframes that are never removed

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Watches new landmarks and removes those that are not found again.
class LandmarkCuller {
 public:
  explicit LandmarkCuller(const CullingOptions& options) : options_(options) {}

  void watch(const std::vector<LandmarkId>& landmarks);

  /// Call once a keyframe. Returns how many were removed.
  int cull(Map& map, KeyframeId newest);

 private:
  CullingOptions options_;
  std::deque<LandmarkId> watched_;
};

/// What a frame shows that speaks against landmarks: images as taken.
struct Contradiction {
  const cv::Mat& moving;  ///< CV_8UC1, nonzero on what moves; may be empty
  const cv::Mat& depth;   ///< CV_32FC1, metres, 0 = unknown; may be empty
};

/// Removes those of the landmarks that lie on what moves, or that the frame sees through, in several frames:
/// they were parts of something that moved. Returns how many. Nothing is decided where depth is unknown.
int cull_contradicted(Map& map, const std::vector<LandmarkId>& landmarks, const Camera& camera,
                      const SE3& T_camera_world, const Contradiction& frame, const MeasurementNoise& noise);

/// Removes the keyframes around one that add nothing: nearly all their landmarks are seen by enough others at
/// the same or a finer level. The first keyframe of a world stays. Returns how many were removed.
int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options);

}  // namespace roslam
