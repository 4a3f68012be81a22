// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pose_optimiser.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/projection_matcher.hpp"

namespace roslam {

/// What a keyframe knows of the map, copied, so that views can be compared with it while the map goes on.
struct Place {
  KeyframeId keyframe;
  std::shared_ptr<const ObservedFrame> view;
  std::vector<std::uint32_t> points;       ///< of the view, that show landmarks
  std::vector<LandmarkId> landmarks;       ///< of each of these
  std::vector<Eigen::Vector3d> positions;  ///< of each of these, world, metres

  /// Nothing if there is no such keyframe, or no longer.
  static std::optional<Place> of(const Map& map, KeyframeId keyframe);
};

/// What a view turned out to show of a place in the map.
struct PlaceMatch {
  KeyframeId place;                   ///< the keyframe that was recognised
  SE3 T_camera_world;                 ///< of the view, in the world as that keyframe has it
  std::vector<LandmarkId> landmarks;  ///< landmark each point of the view shows, or none
  int inliers = 0;                    ///< of these
};

struct PlaceCheckOptions {
  int match_distance = 64;     ///< bits, of matches searched over the whole picture
  double match_ratio = 0.9;    ///< best to second best distance of these
  int min_matches = 15;        ///< matches with a keyframe that make it worth a pose estimate
  int min_agreeing = 7;        ///< of these that must agree on a pose
  int iterations = 1000;       ///< RANSAC samples for a keyframe, at most
  double max_error = 4.0;      ///< pixels a match may be off its reprojection
  int neighbours = 10;         ///< covisible keyframes whose landmarks are searched for, too
  double search_radius = 8.0;  ///< pixels at the finest level, about where the first pose puts a landmark

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Decides whether views show places, by geometry. Few matches that agree are enough for a first pose, as
/// views of one place from two sides have no more: what decides is how many landmarks are found where it puts
/// them.
class PlaceCheck {
 public:
  struct Settings {
    PlaceCheckOptions check;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    MeasurementNoise noise;
  };

  PlaceCheck(const Camera& camera, const Settings& settings);

  /// A first pose from matches with what the keyframe sees: P3P in RANSAC. Nothing if there are too few
  /// matches, or too few that agree. The slow part, which needs no map.
  std::optional<PlaceMatch> recognise(const Place& place, const ObservedFrame& view) const;

  /// Looks for the landmarks of the keyframe and its neighbours where that pose puts them, and improves it.
  /// False if fewer than min_inliers are found.
  bool confirm(const Map& map, const ObservedFrame& view, PlaceMatch& match, int min_inliers);

  /// Both. Nothing if the view does not show what the keyframe and its neighbours see.
  std::optional<PlaceMatch> match(const Map& map, KeyframeId place, const ObservedFrame& view,
                                  int min_inliers);

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
