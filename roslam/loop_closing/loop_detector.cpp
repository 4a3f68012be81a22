// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/loop_detector.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
Eigen::Vector3d centre(const SE3& T_camera_world) { return T_camera_world.inverse().translation(); }

// Path length in metres from one keyframe to another, along the keyframes between them.
double path_between(const Map& map, KeyframeId from, KeyframeId to) {
  double length = 0.0;
  const Keyframe* last = nullptr;
  for (std::uint32_t i = from.value; i <= to.value; ++i) {
    const Keyframe* keyframe = map.find(KeyframeId{i});
    if (keyframe == nullptr) continue;
    // Relative motion is only known within a session and a submap.
    const bool follows =
        last != nullptr && last->session == keyframe->session && last->submap == keyframe->submap;
    if (follows) length += (centre(keyframe->T_camera_world) - centre(last->T_camera_world)).norm();
    last = keyframe;
  }
  return length;
}

bool are_near(const SE3& a, const SE3& b, double metres, double radians) {
  const SE3 difference = a * b.inverse();
  return (centre(a) - centre(b)).norm() <= metres && difference.angle() <= radians;
}
}  // namespace

void LoopDetectorOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("loop.") + message);
  };
  require(min_similarity >= 0.0 && min_similarity <= 1.0, "min_similarity must be 0 to 1");
  require(candidates >= 1, "candidates must be at least 1");
  require(min_inliers >= 6, "min_inliers must be at least 6");
  require(min_shared >= 1, "min_shared must be at least 1");
  require(consistent >= 1, "consistent must be at least 1");
  require(max_gap >= 1, "max_gap must be at least 1 keyframe");
  require(tolerance > 0.0, "tolerance must be positive (metres)");
  require(angle_tolerance > 0.0, "angle_tolerance must be positive (radians)");
  require(max_drift > 0.0 && max_drift <= 1.0, "max_drift must be above 0 and at most 1");
  require(max_correction > 0.0, "max_correction must be positive (metres)");
}

LoopDetector::LoopDetector(const LoopDetectorOptions& options, GeometricVerifier verifier)
    : options_(options), verifier_(std::move(verifier)) {
  options_.validate();
}

std::optional<DetectedLoop> LoopDetector::detect(const Map& map, const KeyframeDatabase& database,
                                                 MapMutex& map_mutex, KeyframeId keyframe) {
  std::shared_ptr<const ObservedFrame> view;
  std::vector<KeyframeSnapshot> candidates;
  {
    const MapLock lock(map_mutex, "loop detection");
    const Keyframe* current = map.find(keyframe);
    if (current == nullptr) return std::nullopt;
    view = current->view;
    for (const KeyframeId id : this->candidates(map, database, keyframe))
      candidates.push_back(*KeyframeSnapshot::of(map, id));
  }
  std::erase_if(hypotheses_, [&](const LoopHypothesis& hypothesis) {
    return keyframe.value - hypothesis.newest.value > static_cast<std::uint32_t>(options_.max_gap);
  });
  for (const KeyframeSnapshot& candidate : candidates) {
    auto match = verifier_.recognise(candidate, *view);
    if (!match) continue;
    const MapLock lock(map_mutex, "loop detection");
    if (map.find(keyframe) == nullptr) return std::nullopt;
    if (!verifier_.confirm(map, *view, *match, options_.min_inliers)) continue;
    if (!is_plausible(map, keyframe, *match)) continue;
    if (support(map, keyframe, *match) >= options_.consistent) {
      const SE3 T_keyframe_matched =
          match->T_camera_world * map.find(match->matched_keyframe)->T_camera_world.inverse();
      return DetectedLoop{keyframe, T_keyframe_matched, *match};
    }
    break;
  }
  return std::nullopt;
}

// The most similar keyframes, none of them covisible with this one or with each other.
std::vector<KeyframeId> LoopDetector::candidates(const Map& map, const KeyframeDatabase& database,
                                                 KeyframeId keyframe) const {
  const BagOfWords* bag = database.find(keyframe);
  if (bag == nullptr) return {};
  const std::set<KeyframeId> near = surroundings(map, keyframe);
  // Scores depend on the scene; those of neighbours normalise them (Galvez-Lopez and Tardos, T-RO 2012).
  double best = 0.0;
  for (const KeyframeId neighbour : near) {
    const BagOfWords* theirs = database.find(neighbour);
    if (neighbour != keyframe && theirs != nullptr) best = std::max(best, similarity(*bag, *theirs));
  }
  const auto accepts = [&](KeyframeId id) { return map.find(id) != nullptr && near.count(id) == 0; };
  std::vector<KeyframeId> result;
  std::set<KeyframeId> covered;
  for (const auto& found : database.similar(*bag, accepts)) {
    if (found.similarity < options_.min_similarity * best) break;
    if (static_cast<int>(result.size()) >= options_.candidates) break;
    if (covered.count(found.keyframe) > 0) continue;
    result.push_back(found.keyframe);
    for (const auto& [neighbour, shared] : map.covisible(found.keyframe, options_.min_shared))
      covered.insert(neighbour);
  }
  return result;
}

// The keyframe, its covisible keyframes, and theirs.
std::set<KeyframeId> LoopDetector::surroundings(const Map& map, KeyframeId keyframe) const {
  std::set<KeyframeId> result{keyframe};
  for (const auto& [neighbour, shared] : map.covisible(keyframe)) {
    result.insert(neighbour);
    if (shared < options_.min_shared) continue;
    for (const auto& [second, theirs] : map.covisible(neighbour, options_.min_shared)) result.insert(second);
  }
  return result;
}

// Rejects perceptual aliasing: a loop may correct only as much as odometry drifts over the path between.
bool LoopDetector::is_plausible(const Map& map, KeyframeId keyframe, const VerifiedMatch& match) const {
  constexpr double kAlways = 0.2;           // metres, after any path
  constexpr double kRadiansPerMetre = 0.5;  // of drift in position, about 30 degrees
  // The relative pose of two submaps is unknown.
  if (map.find(keyframe)->submap != map.find(match.matched_keyframe)->submap) return true;
  const double path = path_between(map, std::min(match.matched_keyframe, keyframe),
                                   std::max(match.matched_keyframe, keyframe));
  const double allowed = std::min(kAlways + options_.max_drift * path, options_.max_correction);
  return are_near(map.find(keyframe)->T_camera_world, match.T_camera_world, allowed,
                  kRadiansPerMetre * allowed);
}

// Temporal consistency: the keyframes so far that agree on the correction, this one included.
int LoopDetector::support(const Map& map, KeyframeId keyframe, const VerifiedMatch& match) {
  const SE3& T_camera_new = map.find(keyframe)->T_camera_world;
  const std::pair submaps(map.find(keyframe)->submap, map.find(match.matched_keyframe)->submap);
  for (auto& hypothesis : hypotheses_) {
    if (hypothesis.submaps != submaps) continue;
    // The pose that the hypothesis predicts for this keyframe, in coordinates of the matched part.
    const SE3 expected = T_camera_new * hypothesis.T_old_new.inverse();
    if (!are_near(expected, match.T_camera_world, options_.tolerance, options_.angle_tolerance)) continue;
    hypothesis.T_old_new = match.T_camera_world.inverse() * T_camera_new;
    hypothesis.newest = keyframe;
    return ++hypothesis.count;
  }
  hypotheses_.push_back({match.T_camera_world.inverse() * T_camera_new, submaps, keyframe, 1});
  return 1;
}

}  // namespace roslam
