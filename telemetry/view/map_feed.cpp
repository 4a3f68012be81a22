// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/map_feed.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

namespace roslam::telemetry {

namespace {
static_assert(std::endian::native == std::endian::little);
constexpr std::size_t kMostRecords = 20000;  // in a reply: half a megabyte of points
constexpr float kStill = 0.005F;             // metres by which a landmark or a pose moves unseen
constexpr std::uint32_t kAll = 1, kMore = 2;

template <typename T>
void put(std::string& bytes, const T& value) {
  const auto begin = bytes.size();
  bytes.resize(begin + sizeof value);
  std::memcpy(bytes.data() + begin, &value, sizeof value);
}

std::string header(bool is_all, bool has_more, std::uint32_t revision, std::size_t count,
                   std::uint32_t submap, float side, std::uint32_t total) {
  std::string bytes;
  put(bytes, (is_all ? kAll : 0U) | (has_more ? kMore : 0U));
  put(bytes, revision);
  put(bytes, static_cast<std::uint32_t>(count));
  put(bytes, submap);
  put(bytes, side);
  put(bytes, total);
  return bytes;
}

template <typename Changes>
std::string header(const Changes& changes, std::uint32_t submap, std::uint32_t total = 0) {
  return header(changes.is_all, changes.has_more, changes.revision, changes.changes.size(), submap, 0.0F,
                total);
}

std::array<float, 3> floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

bool is_near(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < kStill;
}
}  // namespace

bool MapFeed::Point::operator==(const Point& other) const {
  return submap == other.submap && colour == other.colour && is_near(position, other.position);
}

bool MapFeed::Pose::operator==(const Pose& other) const { return is_near(position, other.position); }

void MapFeed::update(const MapSnapshot& map) {
  std::vector<std::pair<std::uint32_t, Keyframe>> keyframes;
  for (const PlacedKeyframe& keyframe : map.keyframes) {
    const auto position = floats(keyframe.T_world_camera.translation());
    const Eigen::Quaternionf q = keyframe.T_world_camera.rotation().cast<float>();
    keyframes.emplace_back(
        keyframe.id.value,
        Keyframe{keyframe.submap.value, {position[0], position[1], position[2], q.w(), q.x(), q.y(), q.z()}});
  }
  std::vector<std::pair<std::uint32_t, Point>> points;
  for (const PlacedLandmark& landmark : map.landmarks) {
    const Eigen::Vector3f& p = landmark.position;
    points.emplace_back(landmark.id.value,
                        Point{landmark.submap.value,
                              {p.x(), p.y(), p.z()},
                              {landmark.colour[2], landmark.colour[1], landmark.colour[0]}});
  }
  std::vector<std::pair<std::uint32_t, Pose>> path;
  for (const StampedPose& pose : map.path)
    path.emplace_back(static_cast<std::uint32_t>(path.size()),
                      Pose{floats(pose.T_world_camera.translation())});
  const std::scoped_lock lock(mutex_);
  keyframes_.replace(keyframes);
  points_.replace(points);
  path_.replace(path);
  path_length_ = static_cast<std::uint32_t>(path.size());
  submap_ = map.main_submap.value;
}

std::string MapFeed::keyframes(std::uint32_t since) const {
  const std::scoped_lock lock(mutex_);
  const auto changes = keyframes_.since(since, kMostRecords);
  std::string bytes = header(changes, submap_);
  for (const auto& change : changes.changes) {
    put(bytes, change.key);
    put(bytes, change.is_gone ? SubmapId::kNone : change.record.submap);
    put(bytes, change.record.pose);
  }
  return bytes;
}

std::string MapFeed::points(std::uint32_t since) const {
  const std::scoped_lock lock(mutex_);
  const auto changes = points_.since(since, kMostRecords);
  std::string bytes = header(changes, submap_);
  for (const auto& change : changes.changes) {
    put(bytes, change.key);
    put(bytes, change.record.submap);
    put(bytes, change.record.position);
    put(bytes, change.record.colour);
    put(bytes, static_cast<std::uint8_t>(change.is_gone ? 1 : 0));
  }
  return bytes;
}

std::string MapFeed::path(std::uint32_t since) const {
  const std::scoped_lock lock(mutex_);
  const auto changes = path_.since(since, kMostRecords);
  std::string bytes = header(changes, submap_, path_length_);
  for (const auto& change : changes.changes) {
    put(bytes, change.key);
    put(bytes, change.record.position);
  }
  return bytes;
}

std::uint64_t MapFeed::revision() const {
  const std::scoped_lock lock(mutex_);
  return std::uint64_t{keyframes_.revision()} + points_.revision() + path_.revision();
}

std::string encode(const SurfaceChanges& changes) {
  std::string bytes =
      header(changes.is_all, changes.has_more, static_cast<std::uint32_t>(changes.revision),
             changes.blocks.size(), changes.submap.value, static_cast<float>(changes.side), 0);
  for (const auto& block : changes.blocks) {
    put(bytes, block->index);
    put(bytes, static_cast<std::uint32_t>(block->points.size()));
    for (const SurfaceBlock::Point& point : block->points) {
      put(bytes, point.position);
      for (const int channel : {2, 1, 0}) put(bytes, point.colour[channel]);
    }
  }
  return bytes;
}

}  // namespace roslam::telemetry
