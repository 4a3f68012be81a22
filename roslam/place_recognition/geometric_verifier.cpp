// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/geometric_verifier.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
SE3 from_rodrigues(const cv::Mat& rotation, const cv::Mat& translation) {
  const Eigen::Vector3d omega(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  return {so3_exp(omega),
          Eigen::Vector3d(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2))};
}
}  // namespace

void GeometricVerifierOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("geometric_verifier.") + message);
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

GeometricVerifier::GeometricVerifier(const Camera& camera, const Settings& settings)
    : camera_(camera), settings_(settings), matcher_(settings.matcher) {
  settings.check.validate();
}

std::optional<KeyframeSnapshot> KeyframeSnapshot::of(const Map& map, KeyframeId id) {
  const Keyframe* keyframe = map.find(id);
  if (keyframe == nullptr) return std::nullopt;
  KeyframeSnapshot snapshot{id, keyframe->view, {}, {}, {}};
  for (std::uint32_t i = 0; i < keyframe->landmarks.size(); ++i) {
    const LandmarkId landmark = keyframe->landmarks[i];
    if (!landmark.is_valid()) continue;
    snapshot.points.push_back(i);
    snapshot.landmarks.push_back(landmark);
    snapshot.positions.push_back(map.find(landmark)->position);
  }
  return snapshot;
}

std::optional<VerifiedMatch> GeometricVerifier::match(const Map& map, KeyframeId keyframe,
                                                      const ObservedFrame& frame, int min_inliers) {
  const auto snapshot = KeyframeSnapshot::of(map, keyframe);
  if (!snapshot) return std::nullopt;
  auto found = recognise(*snapshot, frame);
  if (!found || !confirm(map, frame, *found, min_inliers)) return std::nullopt;
  return found;
}

bool GeometricVerifier::confirm(const Map& map, const ObservedFrame& frame, VerifiedMatch& match,
                                int min_inliers) {
  if (map.find(match.matched_keyframe) == nullptr) return false;
  fit(map, frame, match);
  const auto landmarks = landmarks_around(map, match.matched_keyframe);
  // Wide search first, as a pose from few matches may be inaccurate; then a narrow one from the refined pose.
  for (const double radius : {settings_.check.search_radius, settings_.matcher.map_radius}) {
    search(map, landmarks, frame, radius, match);
    fit(map, frame, match);
  }
  return match.inliers >= min_inliers;
}

std::optional<VerifiedMatch> GeometricVerifier::recognise(const KeyframeSnapshot& snapshot,
                                                          const ObservedFrame& frame) const {
  const GeometricVerifierOptions& options = settings_.check;
  MatcherOptions matching = settings_.matcher;
  matching.strict_distance = options.match_distance;
  matching.ratio = options.match_ratio;
  const auto matches = match_descriptors(*snapshot.view, snapshot.points, frame, matching);
  if (static_cast<int>(matches.size()) < options.min_matches) return std::nullopt;
  std::vector<std::size_t> entry_of(snapshot.view->size());  // position of each point in snapshot.points
  for (std::size_t k = 0; k < snapshot.points.size(); ++k) entry_of[snapshot.points[k]] = k;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const auto& [in_keyframe, in_frame] : matches) {
    const Eigen::Vector3d& p = snapshot.positions[entry_of[in_keyframe]];
    points.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(frame.pixels[in_frame].x(), frame.pixels[in_frame].y());
  }
  const cv::Matx33d matrix(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
  cv::Mat rotation;
  cv::Mat translation;
  std::vector<int> inliers;
  constexpr double kConfidence = 0.999;
  bool is_found = false;
  try {
    is_found = cv::solvePnPRansac(points, pixels, matrix, cv::noArray(), rotation, translation, false,
                                  options.iterations, static_cast<float>(options.max_error), kConfidence,
                                  inliers, cv::SOLVEPNP_P3P);
  } catch (const cv::Exception&) {  // a degenerate sample
    return std::nullopt;
  }
  if (!is_found || static_cast<int>(inliers.size()) < options.min_agreeing) return std::nullopt;
  VerifiedMatch result{snapshot.keyframe, from_rodrigues(rotation, translation),
                       std::vector<LandmarkId>(frame.size()), static_cast<int>(inliers.size())};
  if (!result.T_camera_world.is_finite()) return std::nullopt;
  for (const int i : inliers) {
    const auto& [in_keyframe, in_frame] = matches[static_cast<std::size_t>(i)];
    result.landmarks[in_frame] = snapshot.landmarks[entry_of[in_keyframe]];
  }
  return result;
}

std::vector<LandmarkId> GeometricVerifier::landmarks_around(const Map& map, KeyframeId keyframe) const {
  std::vector<LandmarkId> result;
  std::vector<bool> is_in(map.landmark_slots(), false);
  const auto add_landmarks_of = [&](KeyframeId id) {
    for (const LandmarkId landmark : map.find(id)->landmarks) {
      if (!landmark.is_valid() || is_in[landmark.index()]) continue;
      is_in[landmark.index()] = true;
      result.push_back(landmark);
    }
  };
  add_landmarks_of(keyframe);
  int left = settings_.check.neighbours;
  for (const auto& [neighbour, shared] : map.covisible(keyframe)) {
    if (left-- <= 0) break;
    add_landmarks_of(neighbour);
  }
  return result;
}

// Matches more of the landmarks, by projection.
void GeometricVerifier::search(const Map& map, const std::vector<LandmarkId>& landmarks,
                               const ObservedFrame& frame, double radius, VerifiedMatch& match) {
  std::vector<bool> is_matched(map.landmark_slots(), false);
  for (const LandmarkId id : match.landmarks) {
    if (id.is_valid()) is_matched[id.index()] = true;
  }
  for (const LandmarkId id : landmarks) {
    if (is_matched[id.index()]) continue;
    const Landmark& landmark = *map.find(id);
    const auto predicted = predict(landmark, map, frame, camera_, match.T_camera_world);
    if (!predicted) continue;
    const float pixels = static_cast<float>(radius) * map.scale(predicted->level);
    const int found = matcher_.find({predicted->pixel, pixels, predicted->level - 1, predicted->level + 1,
                                     predicted->depth, settings_.check.match_distance, true},
                                    landmark.descriptor, frame, match.landmarks);
    if (found >= 0) match.landmarks[static_cast<std::size_t>(found)] = id;
  }
}

// Optimises the pose from the matches and removes outliers.
void GeometricVerifier::fit(const Map& map, const ObservedFrame& frame, VerifiedMatch& match) const {
  std::vector<PoseMeasurement> measurements;
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < match.landmarks.size(); ++i) {
    match.landmarks[i] = map.resolve(match.landmarks[i]);
    const Landmark* landmark = map.find(match.landmarks[i]);
    if (landmark == nullptr) {  // removed since it was recognised
      match.landmarks[i] = {};
      continue;
    }
    measurements.push_back({landmark->position, map.measurement(frame, i, settings_.noise)});
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
