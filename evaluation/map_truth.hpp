// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <unordered_map>
#include <vector>

#include "evaluation/removal_error.hpp"
#include "roslam/dense/surface_map.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam::evaluation {

struct MapTruthOptions {
  double range = 8.0;            ///< metres, > 0: depth up to which a map should be complete
  double far_range = 20.0;       ///< metres, >= range: depth up to which map points are compared
  double spacing = 0.02;         ///< metres, > 0: voxel size, one static point a voxel
  double moving_range = 12.0;    ///< metres, > 0: depth up to which movable objects are sampled
  double moving_spacing = 0.03;  ///< metres, > 0: voxel size of their points
  double moving_gap = 0.15;      ///< metres, > 0: least distance of their points in front of the background
  int stride = 2;                ///< pixels, >= 1: step between sampled pixels along rows and columns

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Ground truth of a frame. Images are of the camera's size.
struct MapTruthFrame {
  SE3 T_world_camera;
  cv::Mat background_depth;           ///< CV_32FC1 metres, 0 = unknown
  cv::Mat background_colour;          ///< CV_8UC3 BGR; empty = unknown
  cv::Mat taken_depth;                ///< CV_32FC1 metres, with movable objects; empty = there are none
  std::optional<MovingTruth> moving;  ///< masks of movable objects; nullopt: depth alone tells, none rests
};

/// A point of the static scene.
struct StaticPoint {
  Eigen::Vector3f position;         ///< world frame, metres
  std::optional<cv::Vec3b> colour;  ///< BGR
  float depth = 0.0F;               ///< metres, smallest of the frames that saw it
};

/// A point of a movable object.
struct MovingPoint {
  Eigen::Vector3f position;  ///< world frame, metres
  bool rests = false;        ///< the object did not move, such as a parked car
};

/// Ground truth for a map, from frames of known pose: the static points that it should contain, and the
/// points of movable objects, which it should not.
class MapTruth {
 public:
  /// Throws OptionsError or CalibrationError.
  explicit MapTruth(const Camera& camera, const MapTruthOptions& options = {});

  /// From a complete static cloud: a map should contain all of it. Throws OptionsError.
  explicit MapTruth(const SurfaceMap& surface, const MapTruthOptions& options = {});

  /// Throws InputError if an image is not of the camera's size or of another type.
  void add(const MapTruthFrame& frame);

  /// Of each voxel the point seen from nearest, up to MapTruthOptions::far_range.
  const std::vector<StaticPoint>& static_points() const { return static_; }
  const std::vector<MovingPoint>& moving_points() const { return moving_; }

  /// Whether a map should contain the point.
  bool is_near(const StaticPoint& point) const { return point.depth < static_cast<float>(options_.range); }

 private:
  void check(const MapTruthFrame& frame) const;
  void add_static(const Eigen::Vector3d& position, float depth, const std::optional<cv::Vec3b>& colour);

  Camera camera_;
  MapTruthOptions options_;
  std::vector<Eigen::Vector3d> rays_;  // at depth 1, one a sampled pixel
  std::vector<StaticPoint> static_;
  std::vector<MovingPoint> moving_;
  std::unordered_map<std::uint64_t, std::size_t> static_at_, moving_at_;  // voxel to index
};

}  // namespace roslam::evaluation
