// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/place_recognition/geometric_verifier.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
// A landmark and the point of the frame it was matched with.
struct PointPair {
  Eigen::Vector3d landmark;   // world frame, metres
  Eigen::Vector3d in_camera;  // as the frame measured it, metres
  Eigen::Vector2d pixel;
  double tolerance;  // of distances to it, metres; infinite without depth
  float turn;        // of the image around it, from keyframe to frame, degrees
};
using Sample = std::array<const PointPair*, 4>;  // P3P takes three, and one to choose among its solutions

// One pose turns the image around all points about equally, and a rigid transformation keeps distances.
bool can_agree(const PointPair& a, const PointPair& b) {
  constexpr float kMaxTurn = 30.0F;  // degrees: noise of ORB's orientation, and perspective
  if (std::abs(std::remainder(a.turn - b.turn, 360.0F)) > kMaxTurn) return false;
  const double difference = (a.landmark - b.landmark).norm() - (a.in_camera - b.in_camera).norm();
  return std::abs(difference) <= a.tolerance + b.tolerance;
}

// Draws pairs that can agree. False if the first ones do not, as in nearly all samples with a wrong match:
// they cost a thousandth of P3P.
bool draw(const std::vector<PointPair>& pairs, std::mt19937& random, Sample& sample) {
  for (std::size_t n = 0; n < sample.size(); ++n) {
    sample[n] = &pairs[random() % pairs.size()];
    for (std::size_t k = 0; k < n; ++k)
      if (sample[k] == sample[n] || !can_agree(*sample[k], *sample[n])) return false;
  }
  return true;
}

std::optional<SE3> solve_p3p(const Sample& sample, const Camera& camera) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const PointPair* pair : sample) {
    points.emplace_back(pair->landmark.x(), pair->landmark.y(), pair->landmark.z());
    pixels.emplace_back(pair->pixel.x(), pair->pixel.y());
  }
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d omega;
  cv::Vec3d translation;
  try {
    if (!cv::solvePnP(points, pixels, matrix, cv::noArray(), omega, translation, false, cv::SOLVEPNP_P3P))
      return std::nullopt;
  } catch (const cv::Exception&) {  // a degenerate sample
    return std::nullopt;
  }
  const SE3 pose(so3_exp({omega[0], omega[1], omega[2]}), {translation[0], translation[1], translation[2]});
  return pose.is_finite() ? std::make_optional(pose) : std::nullopt;
}

// RANSAC: the pairs that agree on the best pose, and that pose.
std::vector<std::size_t> find_agreeing(const std::vector<PointPair>& pairs, const Camera& camera,
                                       const GeometricVerifierOptions& options, SE3& T_camera_world) {
  constexpr double kMiss = 0.001;  // probability that no sample is free of outliers, at which it ends
  std::mt19937 random;             // default seed: the same result in every run
  Sample sample{};
  std::vector<std::size_t> best;
  double samples = options.iterations;
  for (int n = 0; n < samples; ++n) {
    if (!draw(pairs, random, sample)) continue;
    const auto pose = solve_p3p(sample, camera);
    if (!pose) continue;
    std::vector<std::size_t> agreeing;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector3d point = *pose * pairs[i].landmark;
      if (point.z() > 0.0 && (camera.project(point) - pairs[i].pixel).norm() <= options.max_error)
        agreeing.push_back(i);
    }
    if (agreeing.size() <= best.size()) continue;
    best = std::move(agreeing);
    T_camera_world = *pose;
    const double share = static_cast<double>(best.size()) / static_cast<double>(pairs.size());
    samples = std::min(samples, std::log(kMiss) / std::log1p(-std::pow(share, 4)));
  }
  return best;
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
  constexpr float kSure = 0.1F;  // of the depth
  std::vector<PointPair> pairs;
  for (const auto& [in_keyframe, in_frame] : matches) {
    const Eigen::Vector2d pixel = frame.pixels[in_frame].cast<double>();
    const auto z = static_cast<double>(frame.depths[in_frame]);
    const double of_stereo = z * z * frame.inverse_depth_sigma(in_frame);
    const double sigma = of_stereo > 0.0 ? of_stereo : settings_.noise.sigma_of_depth(z);
    const double tolerance = 2.0 * sigma + z * options.max_error / camera_.fx;
    pairs.push_back({snapshot.positions[entry_of[in_keyframe]], camera_.unproject(pixel, z), pixel,
                     frame.has_depth(in_frame, kSure) ? tolerance : std::numeric_limits<double>::infinity(),
                     frame.angles[in_frame] - snapshot.view->angles[in_keyframe]});
  }
  SE3 T_camera_world;
  const auto agreeing = find_agreeing(pairs, camera_, options, T_camera_world);
  if (static_cast<int>(agreeing.size()) < options.min_agreeing) return std::nullopt;
  VerifiedMatch result{snapshot.keyframe, T_camera_world, std::vector<LandmarkId>(frame.size()),
                       static_cast<int>(agreeing.size())};
  for (const std::size_t i : agreeing) {
    const auto& [in_keyframe, in_frame] = matches[i];
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
    // With the noise assumed, not the estimated one, which may be less: places match over the drift of the
    // map.
    measurements.push_back(
        {landmark->position,
         Measurement::make(frame.pixels[i], frame.depths[i], map.scale(frame.levels[i]), settings_.noise,
                           frame.inverse_depth_sigma(i))});
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
