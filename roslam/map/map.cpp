// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/map.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/map/map_parts.hpp"

namespace roslam {

namespace {
// A landmark is still recognised slightly nearer and farther than the pyramid levels alone would allow.
constexpr float kNearTolerance = 0.8F;
constexpr float kFarTolerance = 1.2F;

auto* at(const auto& elements, auto id) {
  return id.index() < elements.size() ? elements[id.index()].get() : nullptr;
}

template <typename Id>
std::vector<Id> ids_of(const auto& elements) {
  std::vector<Id> ids;
  for (const auto& element : elements) {
    if (element) ids.push_back(element->id);
  }
  return ids;
}
}  // namespace

KeyframeId Map::add_keyframe(std::size_t frame_index, double timestamp, const SE3& T_camera_world,
                             std::shared_ptr<const ObservedFrame> view, SubmapId submap) {
  return insert(Keyframe{{}, frame_index, timestamp, T_camera_world, std::move(view), {}, submap, session_});
}

KeyframeId Map::insert(Keyframe keyframe) {
  keyframe.id = KeyframeId{static_cast<std::uint32_t>(keyframes_.size())};
  keyframe.landmarks.assign(keyframe.view->size(), {});
  newest_submap_ = std::max(newest_submap_, keyframe.submap.value);
  session_ = std::max(session_, keyframe.session);
  keyframes_.push_back(std::make_unique<Keyframe>(std::move(keyframe)));
  anchors_.emplace_back();
  ++keyframe_count_;
  return keyframes_.back()->id;
}

LandmarkId Map::insert(Landmark landmark) {
  landmark.id = LandmarkId{static_cast<std::uint32_t>(landmarks_.size())};
  for (const auto& [keyframe, point] : landmark.observations) find(keyframe)->landmarks[point] = landmark.id;
  landmarks_.push_back(std::make_unique<Landmark>(std::move(landmark)));
  merged_into_.emplace_back();
  ++landmark_count_;
  return landmarks_.back()->id;
}

void Map::append(const MapParts& other) {
  // Submaps and sessions are renumbered without gaps, too.
  std::map<SubmapId, SubmapId> submap_of;
  std::map<std::uint32_t, std::uint32_t> session_of;
  for (const Keyframe& keyframe : other.keyframes) {
    submap_of[keyframe.submap];
    session_of[keyframe.session];
  }
  std::uint32_t next_submap = keyframe_count_ > 0 ? newest_submap_ + 1 : 0;
  std::uint32_t next_session = keyframe_count_ > 0 ? session_ + 1 : 0;
  for (auto& [theirs, ours] : submap_of) ours = SubmapId{next_submap++};
  for (auto& [theirs, ours] : session_of) ours = next_session++;
  std::vector<KeyframeId> id_of(other.keyframes.empty() ? 0 : other.keyframes.back().id.index() + 1);
  for (Keyframe keyframe : other.keyframes) {
    const std::size_t theirs = keyframe.id.index();
    keyframe.submap = submap_of.at(keyframe.submap);
    keyframe.session = session_of.at(keyframe.session);
    id_of[theirs] = insert(std::move(keyframe));
  }
  const auto ours = [&](KeyframeId id) {
    return id.index() < id_of.size() ? id_of[id.index()] : KeyframeId{};
  };
  for (Landmark landmark : other.landmarks) {
    for (auto& observation : landmark.observations) observation.keyframe = ours(observation.keyframe);
    std::erase_if(landmark.observations, [&](const Observation& o) {
      return !o.keyframe.is_valid() || find(o.keyframe)->landmarks[o.point].is_valid();
    });
    if (landmark.observations.empty()) continue;
    landmark.created_by = ours(landmark.created_by);
    if (!landmark.created_by.is_valid()) landmark.created_by = landmark.observations.front().keyframe;
    insert(std::move(landmark));
  }
  for (const auto& loop : other.loops) {
    if (ours(loop.from).is_valid() && ours(loop.to).is_valid())
      add_loop(ours(loop.from), ours(loop.to), loop.T_to_from);
  }
}

std::vector<SubmapId> Map::submaps() const {
  std::set<SubmapId> result;
  for (const auto& keyframe : keyframes_) {
    if (keyframe) result.insert(keyframe->submap);
  }
  return {result.begin(), result.end()};
}

void Map::transform(SubmapId submap, const SE3& T_new_old) {
  const SE3 T_old_new = T_new_old.inverse();
  for (const auto& landmark : landmarks_) {
    if (!landmark || submap_of(*landmark) != submap) continue;
    landmark->position = T_new_old * landmark->position;
    landmark->normal = T_new_old.rotation() * landmark->normal;
  }
  for (const auto& keyframe : keyframes_) {
    if (keyframe && keyframe->submap == submap)
      keyframe->T_camera_world = keyframe->T_camera_world * T_old_new;
  }
}

void Map::merge_submaps(SubmapId from, SubmapId into) {
  for (const auto& keyframe : keyframes_) {
    if (keyframe && keyframe->submap == from) keyframe->submap = into;
  }
}

Trajectory Map::trajectory(std::uint32_t session, SubmapId submap) const {
  Trajectory result;
  for (const auto& keyframe : keyframes_) {
    if (!keyframe || keyframe->session != session || keyframe->submap != submap) continue;
    result.push_back({keyframe->timestamp, keyframe->T_camera_world.inverse()});
  }
  return result;
}

std::set<KeyframeId> Map::origins() const {
  std::set<KeyframeId> result;
  std::set<SubmapId> found;
  for (const auto& keyframe : keyframes_) {
    if (keyframe && found.insert(keyframe->submap).second) result.insert(keyframe->id);
  }
  return result;
}

LandmarkId Map::add_landmark(const Eigen::Vector3d& position, KeyframeId keyframe, std::uint32_t point) {
  const LandmarkId id{static_cast<std::uint32_t>(landmarks_.size())};
  auto landmark = std::make_unique<Landmark>();
  landmark->id = id;
  landmark->position = position;
  landmark->created_by = keyframe;
  landmark->times_visible = 1;
  landmark->times_found = 1;
  landmark->colour = find(keyframe)->view->colours[point];
  landmarks_.push_back(std::move(landmark));
  merged_into_.emplace_back();
  ++landmark_count_;
  add_observation(id, keyframe, point);
  refresh(id);
  return id;
}

bool Map::add_observation(LandmarkId landmark_id, KeyframeId keyframe_id, std::uint32_t point) {
  Landmark* landmark = find(landmark_id);
  Keyframe* keyframe = find(keyframe_id);
  if (landmark == nullptr || keyframe == nullptr || keyframe->landmarks[point].is_valid()) return false;
  auto& observations = landmark->observations;
  const auto at = std::lower_bound(observations.begin(), observations.end(), keyframe_id,
                                   [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
  if (at != observations.end() && at->keyframe == keyframe_id) return false;
  observations.insert(at, {keyframe_id, point});
  keyframe->landmarks[point] = landmark_id;
  return true;
}

void Map::remove_observation(LandmarkId landmark_id, KeyframeId keyframe_id) {
  Landmark* landmark = find(landmark_id);
  if (landmark == nullptr) return;
  auto& observations = landmark->observations;
  const auto at = std::find_if(observations.begin(), observations.end(),
                               [&](const Observation& o) { return o.keyframe == keyframe_id; });
  if (at == observations.end()) return;
  if (Keyframe* keyframe = find(keyframe_id)) keyframe->landmarks[at->point] = LandmarkId{};
  observations.erase(at);
  if (observations.empty()) remove_landmark(landmark_id);
}

void Map::remove_landmark(LandmarkId id) {
  const Landmark* landmark = find(id);
  if (landmark == nullptr) return;
  for (const auto& observation : landmark->observations) {
    find(observation.keyframe)->landmarks[observation.point] = LandmarkId{};
  }
  landmarks_[id.index()].reset();
  --landmark_count_;
}

void Map::remove_keyframe(KeyframeId id, KeyframeId anchor) {
  Keyframe* keyframe = find(id);
  const Keyframe* anchor_keyframe = find(anchor);
  if (keyframe == nullptr || anchor_keyframe == nullptr || id == anchor) return;
  anchors_[id.index()] = {anchor, keyframe->T_camera_world * anchor_keyframe->T_camera_world.inverse()};
  const std::vector<LandmarkId> seen = keyframe->landmarks;
  for (const LandmarkId landmark : seen) {
    if (landmark.is_valid()) remove_observation(landmark, id);
  }
  keyframes_[id.index()].reset();
  --keyframe_count_;
}

void Map::withdraw(KeyframeId id) {
  withdrawn_.insert(id);
  std::erase_if(loops_, [&](const LoopClosure& loop) { return loop.from == id || loop.to == id; });
}

void Map::remove_withdrawn(KeyframeId id) {
  const Keyframe* keyframe = find(id);
  if (keyframe == nullptr) return;
  // The poses of frames that refer to it are kept relative to the newest other one.
  for (std::uint32_t i = static_cast<std::uint32_t>(keyframes_.size()); i-- > 0;) {
    const Keyframe* other = find(KeyframeId{i});
    const bool is_usable = other != nullptr && i != id.value && other->submap == keyframe->submap &&
                           !is_withdrawn(KeyframeId{i});
    if (is_usable) return remove_keyframe(id, KeyframeId{i});
  }
}

void Map::merge_landmarks(LandmarkId from, LandmarkId into) {
  Landmark* source = find(from);
  Landmark* target = find(into);
  if (source == nullptr || target == nullptr || from == into) return;
  const std::vector<Observation> observations = source->observations;
  target->times_found += source->times_found;
  target->times_visible += source->times_visible;
  remove_landmark(from);
  merged_into_[from.index()] = into;
  for (const auto& observation : observations) add_observation(into, observation.keyframe, observation.point);
  refresh(into);
}

Keyframe* Map::find(KeyframeId id) { return at(keyframes_, id); }
const Keyframe* Map::find(KeyframeId id) const { return at(keyframes_, id); }
Landmark* Map::find(LandmarkId id) { return at(landmarks_, id); }
const Landmark* Map::find(LandmarkId id) const { return at(landmarks_, id); }

LandmarkId Map::resolve(LandmarkId id) const {
  while (id.index() < merged_into_.size() && merged_into_[id.index()].is_valid())
    id = merged_into_[id.index()];
  return id;
}

std::pair<KeyframeId, SE3> Map::T_camera_anchor(KeyframeId id) const {
  if (id.index() >= keyframes_.size())
    throw UsageError("map: " + (id.is_valid()
                                    ? "there never was a keyframe " + std::to_string(id.value)
                                    : std::string("an invalid keyframe id has no pose and no submap")));
  SE3 T_camera_anchor;
  while (find(id) == nullptr) {
    T_camera_anchor = T_camera_anchor * anchors_[id.index()].T_camera_anchor;
    id = anchors_[id.index()].keyframe;
  }
  return {id, T_camera_anchor};
}

SE3 Map::T_camera_world(KeyframeId id) const {
  const auto [anchor, T_camera_anchor] = this->T_camera_anchor(id);
  return T_camera_anchor * find(anchor)->T_camera_world;
}

std::vector<LoopClosure> Map::loops() const {
  std::vector<LoopClosure> result;
  for (const auto& loop : loops_) {
    const auto [from, T_from_anchor] = T_camera_anchor(loop.from);
    const auto [to, T_to_anchor] = T_camera_anchor(loop.to);
    if (from != to) result.push_back({from, to, T_to_anchor.inverse() * loop.T_to_from * T_from_anchor});
  }
  return result;
}

void Map::refresh(LandmarkId id) {
  Landmark* landmark = find(id);
  if (landmark == nullptr) return;
  std::vector<Descriptor> descriptors;
  for (const auto& observation : landmark->observations) {
    descriptors.push_back(find(observation.keyframe)->view->descriptors[observation.point]);
  }
  landmark->descriptor = descriptors[most_typical(descriptors)];
  refresh_geometry(id);
}

void Map::refresh_geometry(LandmarkId id) {
  Landmark* landmark = find(id);
  if (landmark == nullptr) return;
  landmark->normal.setZero();
  for (const auto& observation : landmark->observations) {
    const SE3 T_world_camera = find(observation.keyframe)->T_camera_world.inverse();
    landmark->normal += (T_world_camera.translation() - landmark->position).normalized();
  }
  landmark->normal.normalize();
  // The first observation gives the distance at which the patch has the size of its level.
  const auto& first = landmark->observations.front();
  const Keyframe& keyframe = *find(first.keyframe);
  const double distance = (keyframe.T_camera_world * landmark->position).norm();
  const int level = keyframe.view->levels[first.point];
  landmark->max_distance = static_cast<float>(distance) * scale(level);
  landmark->min_distance = landmark->max_distance / scales_.back() * kNearTolerance;
  landmark->max_distance *= kFarTolerance;
}

int Map::predict_level(const Landmark& landmark, double distance) const {
  const double ratio = landmark.max_distance / kFarTolerance / distance;
  const double step = scales_.size() > 1 ? std::log(scales_[1] / scales_[0]) : 1.0;
  const int level = static_cast<int>(std::ceil(std::log(ratio) / step));
  return std::clamp(level, 0, static_cast<int>(scales_.size()) - 1);
}

std::vector<std::pair<KeyframeId, int>> Map::covisible(KeyframeId id, int min_shared) const {
  const Keyframe* keyframe = find(id);
  std::vector<int> shared(keyframes_.size(), 0);
  if (keyframe != nullptr) {
    for (const LandmarkId landmark_id : keyframe->landmarks) {
      if (!landmark_id.is_valid()) continue;
      for (const auto& observation : find(landmark_id)->observations) ++shared[observation.keyframe.index()];
    }
    shared[id.index()] = 0;
  }
  std::vector<std::pair<KeyframeId, int>> result;
  for (std::uint32_t i = 0; i < shared.size(); ++i) {
    if (shared[i] >= std::max(1, min_shared)) result.emplace_back(KeyframeId{i}, shared[i]);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return result;
}

std::vector<KeyframeId> Map::keyframe_ids() const { return ids_of<KeyframeId>(keyframes_); }
std::vector<LandmarkId> Map::landmark_ids() const { return ids_of<LandmarkId>(landmarks_); }

}  // namespace roslam
