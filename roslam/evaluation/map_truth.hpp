// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <unordered_map>
#include <vector>

#include "roslam/cloud/surface.hpp"
#include "roslam/evaluation/removal_error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

struct MapTruthOptions {
  double range = 8.0;            ///< metres, > 0: depth up to which a map should have what a frame sees
  double far_range = 20.0;       ///< metres, >= range: up to which what a map has can be right
  double spacing = 0.02;         ///< metres, > 0: cubes of that side hold one static point each
  double moving_range = 12.0;    ///< metres, > 0: depth up to which moving things are looked for
  double moving_spacing = 0.03;  ///< metres, > 0
  double moving_gap = 0.15;      ///< metres, > 0, that a moving thing stands before the background at least
  int stride = 2;                ///< pixels, >= 1: one in so many is taken along rows and columns

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// What is known of a frame. Images are of the camera's size.
struct MapTruthFrame {
  SE3 T_world_camera;
  cv::Mat background_depth;           ///< CV_32FC1 metres, 0 = unknown
  cv::Mat background_colour;          ///< CV_8UC3 BGR; empty = unknown
  cv::Mat taken_depth;                ///< CV_32FC1, of the same view with what moves; empty = nothing moves
  std::optional<MovingTruth> moving;  ///< which pixels show it; nothing: depth alone tells, and nothing rests
};

/// A point of what stays.
struct StaticPoint {
  Eigen::Vector3f position;         ///< world, metres
  std::optional<cv::Vec3b> colour;  ///< BGR
  float depth = 0.0F;               ///< metres before the frame that saw it from nearest
};

/// A point of what moves, or could.
struct MovingPoint {
  Eigen::Vector3f position;  ///< world, metres
  bool rests = false;        ///< something movable that did not move, as a parked car
};

/// What a map should show and should not, gathered from frames of known pose.
class MapTruth {
 public:
  /// Throws OptionsError or CalibrationError.
  explicit MapTruth(const Camera& camera, const MapTruthOptions& options = {});

  /// All of it in one cloud, of which a map should have everything and in which nothing moves. Throws
  /// OptionsError.
  explicit MapTruth(const Surface& surface, const MapTruthOptions& options = {});

  /// Throws InputError if an image is not of the camera's size or of another type.
  void add(const MapTruthFrame& frame);

  /// Of each cube the point that was seen from nearest; far ones too, see MapTruthOptions.
  const std::vector<StaticPoint>& static_points() const { return static_; }
  const std::vector<MovingPoint>& moving_points() const { return moving_; }

  /// Whether a map should have the point.
  bool is_near(const StaticPoint& point) const { return point.depth < static_cast<float>(options_.range); }

 private:
  void check(const MapTruthFrame& frame) const;
  void add_static(const Eigen::Vector3d& position, float depth, const std::optional<cv::Vec3b>& colour);

  Camera camera_;
  MapTruthOptions options_;
  std::vector<Eigen::Vector3d> rays_;  // at depth 1, one a pixel taken
  std::vector<StaticPoint> static_;
  std::vector<MovingPoint> moving_;
  std::unordered_map<std::uint64_t, std::size_t> static_at_, moving_at_;  // cube to index
};

}  // namespace roslam
