// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/projection_matcher.hpp"
#include "roslam/tracking/tracked_frame.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// A point of a frame that matches one of the last frame which has depth but no landmark. It serves for the
/// pose of that frame only (ORB-SLAM's temporal points).
struct TemporaryPoint {
  std::uint32_t point = 0;                             ///< of the frame
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, metres
};

/// A pose of a frame and the matches that agree with it.
struct PoseCandidate {
  SE3 T_camera_world;
  std::vector<LandmarkId> landmarks;      ///< landmark each point of the frame shows, or none; inliers only
  std::vector<TemporaryPoint> temporary;  ///< inliers only
  int inliers = 0;                        ///< of landmarks and temporary points
};

/// Estimates the pose of a frame from its matches with one other image, before the local map is searched. Not
/// thread safe; reads the map.
class InitialPoseEstimator {
 public:
  struct Settings {
    TrackerOptions tracker;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    MeasurementNoise noise;
  };

  InitialPoseEstimator(const Camera& camera, const Map& map, const Settings& settings)
      : camera_(camera), map_(map), settings_(settings), matcher_(settings.matcher) {}

  struct Search {
    float radius_factor = 1.0F;                 ///< of matcher.frame_radius
    std::span<const std::uint8_t> rested = {};  ///< as RestingPoints; other movable points are not matched
  };

  /// From the points of the last frame, whose pose is T_world_last, searched for around where the prediction
  /// puts them. Nothing if too few of the matches agree.
  std::optional<PoseCandidate> from_last_frame(const ObservedFrame& view, const TrackedFrame& last,
                                               const SE3& T_world_last, const SE3& predicted_T_camera_world,
                                               const Search& search);

  /// From a keyframe, by descriptors alone. initial_T_camera_world: where the optimisation starts.
  std::optional<PoseCandidate> from_keyframe(const ObservedFrame& view, const Keyframe& keyframe,
                                             const SE3& initial_T_camera_world) const;

  /// The median distance (pixels) between the points of the last frame as two predictions put them into the
  /// image; 0 if none has depth.
  double disagreement(const TrackedFrame& last, const SE3& T_world_last, const SE3& a_T_camera_world,
                      const SE3& b_T_camera_world) const;

 private:
  struct Matches {
    std::vector<std::uint32_t> points;  // of the frame
    std::vector<Eigen::Vector3d> positions;
    std::vector<float> rotations;  // of the feature from one image to the other, degrees

    void keep_consistent_rotation(std::vector<LandmarkId>& landmarks);
  };

  std::optional<PoseCandidate> estimate(const ObservedFrame& view, const Matches& matches,
                                        PoseCandidate candidate) const;
  std::optional<Eigen::Vector3d> position_of(const TrackedFrame& last, std::size_t point,
                                             const SE3& T_world_last) const;

  Camera camera_;
  const Map& map_;
  Settings settings_;
  ProjectionMatcher matcher_;
};

/// Points on movable objects at rest.
struct RestingPoints {
  std::vector<TemporaryPoint> points;  ///< without a landmark
  double weight = 1.0;                 ///< of movable points that have not rested, as PoseMeasurement

  /// For each point of the frame: not 0 on an object that rested for long, which counts like static points.
  /// Empty: none. Movable points that have not are no inliers.
  std::span<const std::uint8_t> rested = {};

  bool has_rested(std::size_t point) const { return point < rested.size() && rested[point] != 0; }
};

/// Optimises the pose of a frame on matches of its points with positions in the world. Unsets the landmarks
/// of outliers.
OptimisedPose optimise_frame(const Camera& camera, const Map& map, const ObservedFrame& view,
                             const std::vector<std::uint32_t>& points,
                             const std::vector<Eigen::Vector3d>& positions, const SE3& initial_T_camera_world,
                             const MeasurementNoise& noise, const PoseOptimiserOptions& options,
                             std::vector<LandmarkId>& landmarks, const RestingPoints& resting = {});

}  // namespace roslam
