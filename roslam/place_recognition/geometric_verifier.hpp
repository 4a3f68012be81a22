// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/projection_matcher.hpp"
#include "roslam/place_recognition/geometric_verifier_options.hpp"

namespace roslam {

/// Copy of a keyframe and its landmarks, so that frames can be matched with it without locking the map.
struct KeyframeSnapshot {
  KeyframeId keyframe;
  std::shared_ptr<const ObservedFrame> view;
  std::vector<std::uint32_t> points;       ///< indices of the points of the view with a landmark
  std::vector<LandmarkId> landmarks;       ///< landmark of each of these points
  std::vector<Eigen::Vector3d> positions;  ///< position of each of these landmarks, world frame, metres

  /// Nothing if the keyframe does not exist or was removed.
  static std::optional<KeyframeSnapshot> of(const Map& map, KeyframeId keyframe);
};

/// A frame recognised in the map.
struct VerifiedMatch {
  KeyframeId matched_keyframe;        ///< keyframe that was recognised
  SE3 T_camera_world;                 ///< pose of the frame in the world frame of that keyframe's submap
  std::vector<LandmarkId> landmarks;  ///< landmark observed by each point of the frame, or none
  int inliers = 0;                    ///< number of these that agree on the pose
};

/// Geometric verification of place recognition candidates. A few consistent matches are enough for a first
/// pose, as images of a place from two directions have no more; the decision rests on how many landmarks are
/// then found by projection. recognise is safe to call from several threads, the other functions are not.
class GeometricVerifier {
 public:
  struct Settings {
    GeometricVerifierOptions check;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    MeasurementNoise noise;
  };

  GeometricVerifier(const Camera& camera, const Settings& settings);

  /// A first pose from descriptor matches with the keyframe, by P3P in RANSAC. Nothing if there are too few
  /// matches or inliers. The slow part, which needs no map.
  std::optional<VerifiedMatch> recognise(const KeyframeSnapshot& snapshot, const ObservedFrame& frame) const;

  /// Searches for the landmarks of the keyframe and its neighbours by projection and refines the pose. False
  /// if fewer than min_inliers are found.
  bool confirm(const Map& map, const ObservedFrame& frame, VerifiedMatch& match, int min_inliers);

  /// Both steps. Nothing if either fails.
  std::optional<VerifiedMatch> match(const Map& map, KeyframeId keyframe, const ObservedFrame& frame,
                                     int min_inliers);

 private:
  std::vector<LandmarkId> landmarks_around(const Map& map, KeyframeId keyframe) const;
  void search(const Map& map, const std::vector<LandmarkId>& landmarks, const ObservedFrame& frame,
              double radius, VerifiedMatch& match);
  void fit(const Map& map, const ObservedFrame& frame, VerifiedMatch& match) const;

  Camera camera_;
  Settings settings_;
  ProjectionMatcher matcher_;
};

}  // namespace roslam
