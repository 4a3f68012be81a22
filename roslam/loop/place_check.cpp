// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/place_check.hpp"

#include "roslam/error.hpp"

namespace roslam {

void PlaceCheckOptions::validate() const {
  if (neighbours < 0) throw OptionsError("place_check.neighbours must not be negative");
  if (!(search_radius > 0.0 && search_radius < 1000.0))
    throw OptionsError("place_check.search_radius must be 0 to 1000 pixels");
  if (min_inliers < 6) throw OptionsError("place_check.min_inliers must be at least 6");
}

PlaceCheck::PlaceCheck(const Camera& camera, const Settings& settings)
    : camera_(camera), settings_(settings), matcher_(settings.matcher) {}

std::optional<PlaceMatch> PlaceCheck::match(const Map& map, KeyframeId place, const ObservedFrame& view) {
  const Keyframe* keyframe = map.find(place);
  if (keyframe == nullptr) return std::nullopt;
  const auto recognised = recognise(map, *keyframe, view, camera_, settings_.recognise, settings_.matcher);
  if (!recognised) return std::nullopt;
  PlaceMatch match{place, recognised->T_camera_world, recognised->landmarks, 0};
  fit(map, view, match);
  const auto landmarks = landmarks_around(map, place);
  // Wide first, as a pose from few matches may be off; then once more from where the landmarks put it.
  for (const double radius : {settings_.check.search_radius, settings_.matcher.map_radius}) {
    search(map, landmarks, view, radius, match);
    fit(map, view, match);
  }
  if (match.inliers < settings_.check.min_inliers) return std::nullopt;
  return match;
}

std::vector<LandmarkId> PlaceCheck::landmarks_around(const Map& map, KeyframeId place) const {
  std::vector<LandmarkId> result;
  std::vector<bool> is_in(map.landmark_slots(), false);
  const auto add_landmarks_of = [&](KeyframeId id) {
    for (const LandmarkId landmark : map.find(id)->landmarks) {
      if (!landmark.is_valid() || is_in[landmark.index()]) continue;
      is_in[landmark.index()] = true;
      result.push_back(landmark);
    }
  };
  add_landmarks_of(place);
  int left = settings_.check.neighbours;
  for (const auto& [neighbour, shared] : map.covisible(place)) {
    if (left-- <= 0) break;
    add_landmarks_of(neighbour);
  }
  return result;
}

// Finds more of the landmarks, about where the pose puts them.
void PlaceCheck::search(const Map& map, const std::vector<LandmarkId>& landmarks, const ObservedFrame& view,
                        double radius, PlaceMatch& match) {
  std::vector<bool> is_matched(map.landmark_slots(), false);
  for (const LandmarkId id : match.landmarks) {
    if (id.is_valid()) is_matched[id.index()] = true;
  }
  for (const LandmarkId id : landmarks) {
    if (is_matched[id.index()]) continue;
    const Landmark& landmark = *map.find(id);
    const auto predicted = predict(landmark, map, view, camera_, match.T_camera_world);
    if (!predicted) continue;
    const float pixels = static_cast<float>(radius) * map.scale(predicted->level);
    const int found = matcher_.find({predicted->pixel, pixels, predicted->level - 1, predicted->level + 1,
                                     predicted->depth, settings_.matcher.strict_distance, true},
                                    landmark.descriptor, view, match.landmarks);
    if (found >= 0) match.landmarks[static_cast<std::size_t>(found)] = id;
  }
}

// The pose that the matches agree on; forgets those that do not.
void PlaceCheck::fit(const Map& map, const ObservedFrame& view, PlaceMatch& match) const {
  std::vector<PoseMeasurement> measurements;
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < match.landmarks.size(); ++i) {
    if (!match.landmarks[i].is_valid()) continue;
    measurements.push_back(
        {map.find(match.landmarks[i])->position, map.measurement(view, i, settings_.noise)});
    points.push_back(i);
  }
  const OptimisedPose pose = optimise_pose(camera_, measurements, match.T_camera_world, settings_.pose);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!pose.is_inlier[k]) match.landmarks[points[k]] = {};
  }
  match.T_camera_world = pose.T_camera_world;
  match.inliers = pose.inliers;
}

}  // namespace roslam
