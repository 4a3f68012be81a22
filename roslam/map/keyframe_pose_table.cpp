// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/keyframe_pose_table.hpp"

#include <string>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
KeyframePose pose_of(const Map& map, KeyframeId id) {
  return map.is_withdrawn(id) ? KeyframePose{} : keyframe_pose(map, id);
}
}  // namespace

KeyframePose keyframe_pose(const Map& map, KeyframeId id) {
  const auto [anchor, T_camera_anchor] = map.T_camera_anchor(id);
  const Keyframe& keyframe = *map.find(anchor);
  return {keyframe.submap, (T_camera_anchor * keyframe.T_camera_world).inverse()};
}

void KeyframePoseTable::publish(const Map& map) {
  auto poses = std::make_shared<Poses>();
  poses->reserve(map.keyframe_slots());
  for (std::uint32_t i = 0; i < map.keyframe_slots(); ++i) poses->push_back(pose_of(map, KeyframeId{i}));
  corrections_ = map.corrections();
  replace(std::move(poses));
}

void KeyframePoseTable::add(const Map& map, KeyframeId keyframe) {
  const auto known = current();
  // After a correction the others lie elsewhere as well: all poses have to be of one state of the map.
  if (known->size() != keyframe.index() || corrections_ != map.corrections()) return publish(map);
  auto poses = std::make_shared<Poses>();
  poses->reserve(known->size() + 1);
  *poses = *known;
  poses->push_back(pose_of(map, keyframe));
  replace(std::move(poses));
}

std::vector<KeyframePose> KeyframePoseTable::find(const std::vector<KeyframeId>& keyframes) const {
  const auto poses = current();
  std::vector<KeyframePose> result;
  result.reserve(keyframes.size());
  for (const KeyframeId id : keyframes) {
    if (id.index() >= poses->size())
      throw UsageError("keyframe " + std::to_string(id.value) + " has no published pose");
    result.push_back((*poses)[id.index()]);
  }
  return result;
}

void KeyframePoseTable::replace(std::shared_ptr<const Poses> poses) {
  const std::scoped_lock lock(mutex_);
  poses_.swap(poses);
}

std::shared_ptr<const KeyframePoseTable::Poses> KeyframePoseTable::current() const {
  const std::scoped_lock lock(mutex_);
  return poses_;
}

}  // namespace roslam
