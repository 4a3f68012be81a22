// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/atlas/saved_map.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "roslam/error.hpp"

namespace roslam {

namespace {
// What decides where a point of the world is seen; how depth is stored and how fast frames come does not.
bool see_alike(const Camera& a, const Camera& b) {
  // Camera files round.
  const auto alike = [](double x, double y) { return std::abs(x - y) <= 1e-9 * std::max(1.0, std::abs(x)); };
  return a.width == b.width && a.height == b.height && alike(a.fx, b.fx) && alike(a.fy, b.fy) &&
         alike(a.cx, b.cx) && alike(a.cy, b.cy) &&
         std::equal(a.distortion.begin(), a.distortion.end(), b.distortion.begin(), alike);
}

std::string in_words(const Camera& camera) {
  std::ostringstream text;
  text << camera.width << "x" << camera.height << ", fx " << camera.fx << ", fy " << camera.fy << ", cx "
       << camera.cx << ", cy " << camera.cy;
  return text.str();
}
}  // namespace

SavedMap SavedMap::of(const Camera& camera, const Map& map, const PlaceIndex* places) {
  SavedMap saved;
  saved.camera = camera;
  saved.map = Map({map.scales().begin(), map.scales().end()});
  saved.map.append(map);
  // What adjustment threw to infinity is of no use to anybody, and no reader would take it.
  for (const LandmarkId id : saved.map.landmark_ids()) {
    const Eigen::Vector3d& position = saved.map.find(id)->position;
    if (!position.allFinite() || position.cwiseAbs().maxCoeff() > 1e6) saved.map.remove_landmark(id);
  }
  if (places == nullptr) return saved;
  saved.vocabulary = places->vocabulary().fingerprint();
  for (const KeyframeId id : map.keyframe_ids()) {
    const BagOfWords* bag = places->find(id);
    saved.words.push_back(bag != nullptr ? *bag : BagOfWords{});
  }
  return saved;
}

void SavedMap::require_fits(const Camera& other, std::span<const float> scales) const {
  if (!see_alike(camera, other)) {
    throw InputError(name + ": made with another camera (" + in_words(camera) + "; this one: " +
                     in_words(other) + "); give the --camera it was made with, or another map");
  }
  if (!std::ranges::equal(map.scales(), scales)) {
    throw InputError(name + ": made with other pyramid levels (orb.levels or orb.scale_factor); give the " +
                     "--config it was made with, or another map");
  }
}

void SavedMap::index(PlaceIndex& places) const {
  const bool has_words = vocabulary == places.vocabulary().fingerprint();
  for (const KeyframeId id : map.keyframe_ids()) {
    const bool is_known = has_words && id.index() < words.size() && !words[id.index()].empty();
    places.add(id, is_known ? words[id.index()] : places.describe(*map.find(id)->view));
  }
}

}  // namespace roslam
