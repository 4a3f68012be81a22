// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/place_check.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/error.hpp"

namespace roslam {

namespace {
SE3 from_rodrigues(const cv::Mat& rotation, const cv::Mat& translation) {
  const Eigen::Vector3d omega(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  return {so3_exp(omega),
          Eigen::Vector3d(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2))};
}
}  // namespace

void PlaceCheckOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("place_check.") + message);
  };
  require(match_distance >= 0 && match_distance <= kDescriptorBits, "match_distance must be 0 to 256 bits");
  require(match_ratio > 0.0 && match_ratio <= 1.0, "match_ratio must be above 0 and at most 1");
  require(min_matches >= 4, "min_matches must be at least 4");
  require(min_agreeing >= 4, "min_agreeing must be at least 4");
  require(iterations >= 1, "iterations must be at least 1");
  require(max_error > 0.0, "max_error must be positive (pixels)");
  require(neighbours >= 0, "neighbours must not be negative");
  require(search_radius > 0.0 && search_radius < 1000.0, "search_radius must be 0 to 1000 pixels");
}

PlaceCheck::PlaceCheck(const Camera& camera, const Settings& settings)
    : camera_(camera), settings_(settings), matcher_(settings.matcher) {
  settings.check.validate();
}

std::optional<Place> Place::of(const Map& map, KeyframeId id) {
  const Keyframe* keyframe = map.find(id);
  if (keyframe == nullptr) return std::nullopt;
  Place place{id, keyframe->view, {}, {}, {}};
  for (std::uint32_t i = 0; i < keyframe->landmarks.size(); ++i) {
    const LandmarkId landmark = keyframe->landmarks[i];
    if (!landmark.is_valid()) continue;
    place.points.push_back(i);
    place.landmarks.push_back(landmark);
    place.positions.push_back(map.find(landmark)->position);
  }
  return place;
}

std::optional<PlaceMatch> PlaceCheck::match(const Map& map, KeyframeId keyframe, const ObservedFrame& view,
                                            int min_inliers) {
  const auto place = Place::of(map, keyframe);
  if (!place) return std::nullopt;
  auto found = recognise(*place, view);
  if (!found || !confirm(map, view, *found, min_inliers)) return std::nullopt;
  return found;
}

bool PlaceCheck::confirm(const Map& map, const ObservedFrame& view, PlaceMatch& match, int min_inliers) {
  if (map.find(match.place) == nullptr) return false;
  fit(map, view, match);
  const auto landmarks = landmarks_around(map, match.place);
  // Wide first, as a pose from few matches may be off; then once more from where the landmarks put it.
  for (const double radius : {settings_.check.search_radius, settings_.matcher.map_radius}) {
    search(map, landmarks, view, radius, match);
    fit(map, view, match);
  }
  return match.inliers >= min_inliers;
}

std::optional<PlaceMatch> PlaceCheck::recognise(const Place& place, const ObservedFrame& view) const {
  const PlaceCheckOptions& options = settings_.check;
  MatcherOptions matching = settings_.matcher;
  matching.strict_distance = options.match_distance;
  matching.ratio = options.match_ratio;
  const auto matches = match_descriptors(*place.view, place.points, view, matching);
  if (static_cast<int>(matches.size()) < options.min_matches) return std::nullopt;
  std::vector<std::size_t> known(place.view->size());  // of each point of the place, where it is listed
  for (std::size_t k = 0; k < place.points.size(); ++k) known[place.points[k]] = k;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const auto& [in_place, in_view] : matches) {
    const Eigen::Vector3d& p = place.positions[known[in_place]];
    points.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(view.pixels[in_view].x(), view.pixels[in_view].y());
  }
  const cv::Matx33d matrix(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
  cv::Mat rotation;
  cv::Mat translation;
  std::vector<int> agreeing;
  constexpr double kConfidence = 0.999;
  bool is_found = false;
  try {
    is_found = cv::solvePnPRansac(points, pixels, matrix, cv::noArray(), rotation, translation, false,
                                  options.iterations, static_cast<float>(options.max_error), kConfidence,
                                  agreeing, cv::SOLVEPNP_P3P);
  } catch (const cv::Exception&) {  // a degenerate sample
    return std::nullopt;
  }
  if (!is_found || static_cast<int>(agreeing.size()) < options.min_agreeing) return std::nullopt;
  PlaceMatch result{place.keyframe, from_rodrigues(rotation, translation),
                    std::vector<LandmarkId>(view.size()), static_cast<int>(agreeing.size())};
  if (!result.T_camera_world.is_finite()) return std::nullopt;
  for (const int i : agreeing) {
    const auto& [in_place, in_view] = matches[static_cast<std::size_t>(i)];
    result.landmarks[in_view] = place.landmarks[known[in_place]];
  }
  return result;
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
                                     predicted->depth, settings_.check.match_distance, true},
                                    landmark.descriptor, view, match.landmarks);
    if (found >= 0) match.landmarks[static_cast<std::size_t>(found)] = id;
  }
}

// The pose that the matches agree on; forgets those that do not.
void PlaceCheck::fit(const Map& map, const ObservedFrame& view, PlaceMatch& match) const {
  std::vector<PoseMeasurement> measurements;
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < match.landmarks.size(); ++i) {
    match.landmarks[i] = map.resolve(match.landmarks[i]);
    const Landmark* landmark = map.find(match.landmarks[i]);
    if (landmark == nullptr) {  // gone since it was recognised
      match.landmarks[i] = {};
      continue;
    }
    measurements.push_back({landmark->position, map.measurement(view, i, settings_.noise)});
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
