// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/loop_detector.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "roslam/error.hpp"

namespace roslam {

namespace {
Eigen::Vector3d centre(const SE3& T_camera_world) { return T_camera_world.inverse().translation(); }

// Metres flown from one keyframe to another, along the keyframes between them.
double path_between(const Map& map, KeyframeId from, KeyframeId to) {
  double length = 0.0;
  const Keyframe* last = nullptr;
  for (std::uint32_t i = from.value; i <= to.value; ++i) {
    const Keyframe* keyframe = map.find(KeyframeId{i});
    if (keyframe == nullptr) continue;
    // Between flights nothing was flown.
    const bool follows =
        last != nullptr && last->flight == keyframe->flight && last->world == keyframe->world;
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
  require(patience >= 1, "patience must be at least 1 keyframe");
  require(tolerance > 0.0, "tolerance must be positive (metres)");
  require(angle_tolerance > 0.0, "angle_tolerance must be positive (radians)");
  require(max_drift > 0.0 && max_drift <= 1.0, "max_drift must be above 0 and at most 1");
}

LoopDetector::LoopDetector(const LoopDetectorOptions& options, PlaceCheck check)
    : options_(options), check_(std::move(check)) {
  options_.validate();
}

std::optional<Loop> LoopDetector::detect(const Map& map, const PlaceIndex& places, MapMutex& map_mutex,
                                         KeyframeId keyframe) {
  std::shared_ptr<const ObservedFrame> view;
  std::vector<Place> candidates;
  {
    const std::scoped_lock lock(map_mutex);
    const Keyframe* current = map.find(keyframe);
    if (current == nullptr) return std::nullopt;
    view = current->view;
    for (const KeyframeId id : this->candidates(map, places, keyframe))
      candidates.push_back(*Place::of(map, id));
  }
  std::erase_if(suspicions_, [&](const Suspicion& suspicion) {
    return keyframe.value - suspicion.newest.value > static_cast<std::uint32_t>(options_.patience);
  });
  for (const Place& place : candidates) {
    auto match = check_.recognise(place, *view);
    if (!match) continue;
    const std::scoped_lock lock(map_mutex);
    if (map.find(keyframe) == nullptr) return std::nullopt;
    if (!check_.confirm(map, *view, *match, options_.min_inliers)) continue;
    if (!is_plausible(map, keyframe, *match)) continue;
    if (support(map, keyframe, *match) >= options_.consistent) {
      const SE3 T_keyframe_place = match->T_camera_world * map.find(match->place)->T_camera_world.inverse();
      return Loop{keyframe, T_keyframe_place, *match};
    }
    break;
  }
  return std::nullopt;
}

// The most similar keyframes that lie apart from this one and from each other.
std::vector<KeyframeId> LoopDetector::candidates(const Map& map, const PlaceIndex& places,
                                                 KeyframeId keyframe) const {
  const BagOfWords* bag = places.find(keyframe);
  if (bag == nullptr) return {};
  const std::set<KeyframeId> near = surroundings(map, keyframe);
  // How alike two pictures of one place are depends on the place: what is next to it tells.
  double usual = 0.0;
  for (const KeyframeId neighbour : near) {
    const BagOfWords* theirs = places.find(neighbour);
    if (neighbour != keyframe && theirs != nullptr) usual = std::max(usual, similarity(*bag, *theirs));
  }
  const auto accepts = [&](KeyframeId id) { return map.find(id) != nullptr && near.count(id) == 0; };
  std::vector<KeyframeId> result;
  std::set<KeyframeId> covered;
  for (const auto& found : places.similar(*bag, accepts)) {
    if (found.similarity < options_.min_similarity * usual) break;
    if (static_cast<int>(result.size()) >= options_.candidates) break;
    if (covered.count(found.keyframe) > 0) continue;
    result.push_back(found.keyframe);
    for (const auto& [neighbour, shared] : map.covisible(found.keyframe, options_.min_shared))
      covered.insert(neighbour);
  }
  return result;
}

// The keyframe, its neighbours, and theirs.
std::set<KeyframeId> LoopDetector::surroundings(const Map& map, KeyframeId keyframe) const {
  std::set<KeyframeId> result{keyframe};
  for (const auto& [neighbour, shared] : map.covisible(keyframe)) {
    result.insert(neighbour);
    if (shared < options_.min_shared) continue;
    for (const auto& [second, theirs] : map.covisible(neighbour, options_.min_shared)) result.insert(second);
  }
  return result;
}

// Odometry drifts by a small share of the path; a place that looks like another lies anywhere.
bool LoopDetector::is_plausible(const Map& map, KeyframeId keyframe, const PlaceMatch& match) const {
  constexpr double kAlways = 0.2;           // metres
  constexpr double kRadiansPerMetre = 0.5;  // of drift in position, about 30 degrees
  // Worlds lie to each other in any way.
  if (map.find(keyframe)->world != map.find(match.place)->world) return true;
  const double path = path_between(map, std::min(match.place, keyframe), std::max(match.place, keyframe));
  const double allowed = kAlways + options_.max_drift * path;
  return are_near(map.find(keyframe)->T_camera_world, match.T_camera_world, allowed,
                  kRadiansPerMetre * allowed);
}

// How many keyframes recognised places so far as this one did, itself included.
int LoopDetector::support(const Map& map, KeyframeId keyframe, const PlaceMatch& match) {
  const SE3& T_camera_new = map.find(keyframe)->T_camera_world;
  const std::pair worlds(map.find(keyframe)->world, map.find(match.place)->world);
  for (auto& suspicion : suspicions_) {
    if (suspicion.worlds != worlds) continue;
    // Where the camera would be if the suspicion were right.
    const SE3 expected = T_camera_new * suspicion.T_old_new.inverse();
    if (!are_near(expected, match.T_camera_world, options_.tolerance, options_.angle_tolerance)) continue;
    suspicion.T_old_new = match.T_camera_world.inverse() * T_camera_new;
    suspicion.newest = keyframe;
    return ++suspicion.count;
  }
  suspicions_.push_back({match.T_camera_world.inverse() * T_camera_new, worlds, keyframe, 1});
  return 1;
}

}  // namespace roslam
