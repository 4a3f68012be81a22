// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pose_optimiser.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/projection_matcher.hpp"
#include "roslam/tracking/relocaliser.hpp"

namespace roslam {

/// What a view turned out to show of a place in the map.
struct PlaceMatch {
  KeyframeId place;                   ///< the keyframe that was recognised
  SE3 T_camera_world;                 ///< of the view, in the world as that keyframe has it
  std::vector<LandmarkId> landmarks;  ///< landmark each point of the view shows, or none
  int inliers = 0;                    ///< of these
};

struct PlaceCheckOptions {
  int neighbours = 10;         ///< covisible keyframes whose landmarks are searched for, too
  double search_radius = 8.0;  ///< pixels at the finest level, about where the first pose puts a landmark
  int min_inliers = 60;        ///< landmarks that must agree on the pose

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Decides whether views show places, by geometry.
class PlaceCheck {
 public:
  struct Settings {
    PlaceCheckOptions check;
    RelocaliserOptions recognise;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    MeasurementNoise noise;
  };

  PlaceCheck(const Camera& camera, const Settings& settings);

  /// Nothing if the view does not show what the keyframe and its neighbours see: too few matches, too few
  /// that agree on a pose, or too few landmarks found where that pose puts them.
  std::optional<PlaceMatch> match(const Map& map, KeyframeId place, const ObservedFrame& view);

 private:
  std::vector<LandmarkId> landmarks_around(const Map& map, KeyframeId place) const;
  void search(const Map& map, const std::vector<LandmarkId>& landmarks, const ObservedFrame& view,
              double radius, PlaceMatch& match);
  void fit(const Map& map, const ObservedFrame& view, PlaceMatch& match) const;

  Camera camera_;
  Settings settings_;
  ProjectionMatcher matcher_;
};

}  // namespace roslam
