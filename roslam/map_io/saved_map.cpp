// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map_io/saved_map.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/map/map_parts.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"

namespace roslam {

namespace {
// Compares the projection model only; depth units and frame rate do not matter.
bool have_same_projection(const Camera& a, const Camera& b) {
  // Camera files hold rounded values.
  const auto is_close = [](double x, double y) {
    return std::abs(x - y) <= 1e-9 * std::max(1.0, std::abs(x));
  };
  return a.width == b.width && a.height == b.height && is_close(a.fx, b.fx) && is_close(a.fy, b.fy) &&
         is_close(a.cx, b.cx) && is_close(a.cy, b.cy) && a.model == b.model &&
         std::equal(a.distortion.begin(), a.distortion.end(), b.distortion.begin(), is_close);
}

std::string in_words(const Camera& camera) {
  std::ostringstream text;
  text << camera.width << "x" << camera.height << ", fx " << camera.fx << ", fy " << camera.fy << ", cx "
       << camera.cx << ", cy " << camera.cy;
  return text.str();
}
}  // namespace

SavedMap SavedMap::of(const Camera& camera, const Map& map, const KeyframeDatabase* database) {
  MapMutex mutex;
  return of(camera, map, database, mutex, {});
}

SavedMap SavedMap::of(const Camera& camera, const Map& map, const KeyframeDatabase* database, MapMutex& mutex,
                      const std::set<SubmapId>& without) {
  const MapParts parts = MapParts::of(map, mutex, without);
  SavedMap saved;
  saved.camera = camera;
  saved.map = Map(parts.scales);
  saved.map.append(parts);
  // Landmarks that bundle adjustment moved out of range are useless, and load_map would refuse them.
  for (const LandmarkId id : saved.map.landmark_ids()) {
    const Eigen::Vector3d& position = saved.map.find(id)->position;
    if (!position.allFinite() || position.cwiseAbs().maxCoeff() > 1e6) saved.map.remove_landmark(id);
  }
  if (database == nullptr) return saved;
  saved.vocabulary = database->vocabulary().fingerprint();
  constexpr std::size_t kPerLock = 100;  // keyframes
  for (std::size_t begin = 0; begin < parts.keyframes.size(); begin += kPerLock) {
    const MapLock lock(mutex, "copy of the map");
    for (std::size_t i = begin; i < std::min(begin + kPerLock, parts.keyframes.size()); ++i) {
      const BagOfWords* bag = database->find(parts.keyframes[i].id);
      saved.words.push_back(bag != nullptr ? *bag : BagOfWords{});
    }
  }
  return saved;
}

void SavedMap::require_fits(const Camera& other, std::span<const float> scales) const {
  if (!have_same_projection(camera, other)) {
    throw InputError(name + ": made with another camera (" + in_words(camera) + "; this one: " +
                     in_words(other) + "); give the --camera it was made with, or another map");
  }
  if (!std::ranges::equal(map.scales(), scales)) {
    throw InputError(name + ": made with other pyramid levels (orb.levels or orb.scale_factor); give the " +
                     "--config it was made with, or another map");
  }
}

void SavedMap::index(KeyframeDatabase& database) const {
  const bool has_words = vocabulary == database.vocabulary().fingerprint();
  for (const KeyframeId id : map.keyframe_ids()) {
    const bool is_known = has_words && id.index() < words.size() && !words[id.index()].empty();
    database.add(id, is_known ? words[id.index()] : database.describe(*map.find(id)->view));
  }
}

}  // namespace roslam
