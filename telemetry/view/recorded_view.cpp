// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/recorded_view.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace roslam::telemetry {

namespace {
constexpr SubmapId kOnly{0};
constexpr float kSide = 1.0F;            // metres, of a block
constexpr float kFarthest = 1000000.0F;  // metres, beyond which nothing is shown

std::shared_ptr<const MapSnapshot> map_of(const RecordedView::Contents& contents) {
  auto map = std::make_shared<MapSnapshot>();
  map->frames = contents.path.size();
  map->main_submap = kOnly;
  map->path = contents.path;
  for (const StampedPose& pose : contents.keyframes)
    map->keyframes.push_back({KeyframeId{static_cast<std::uint32_t>(map->keyframes.size())}, kOnly,
                              pose.timestamp, pose.T_world_camera});
  for (const RecordedView::Point& point : contents.landmarks)
    map->landmarks.push_back(
        {LandmarkId{static_cast<std::uint32_t>(map->landmarks.size())}, kOnly, point.position, point.colour});
  return map;
}
}  // namespace

RecordedView::RecordedView(const Contents& contents) : map_(map_of(contents)), image_(contents.image) {
  add_surfaces(contents.dense);
  status_.run = contents.run;
  status_.source = contents.source;
  status_.phase = RunPhase::kRecorded;
  status_.has_images = !image_.empty();
  status_.processed = status_.tracked = contents.path.size();
  status_.keyframes = contents.keyframes.size();
  status_.submap = kOnly;
  if (!contents.path.empty()) {
    status_.begun = contents.path.front().timestamp;
    status_.timestamp = contents.path.back().timestamp;
    status_.T_world_camera = contents.path.back().T_world_camera;
    status_.state = TrackingState::kTracking;
  }
  for (const std::string& note : contents.notes)
    log_.push_back({++status_.log_number, status_.timestamp, false, note});
}

void RecordedView::add_surfaces(const std::vector<Point>& points) {
  std::map<std::array<std::int32_t, 3>, std::shared_ptr<SurfaceBlock>> blocks;
  for (const Point& point : points) {
    if (!point.position.allFinite() || point.position.cwiseAbs().maxCoeff() > kFarthest) continue;
    std::array<std::int32_t, 3> index{};
    SurfaceBlock::Point packed;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float place = point.position[static_cast<Eigen::Index>(axis)] / kSide;
      index[axis] = static_cast<std::int32_t>(std::floor(place));
      packed.position[axis] =
          static_cast<std::uint8_t>(std::min(255.0F, 256.0F * (place - std::floor(place))));
    }
    packed.colour = point.colour;
    auto& block = blocks[index];
    if (!block) block = std::make_shared<SurfaceBlock>();
    block->index = index;
    block->points.push_back(packed);
  }
  for (auto& [index, block] : blocks) blocks_.push_back(std::move(block));
}

SurfaceChanges RecordedView::surface(SubmapId submap, std::uint64_t revision, std::size_t most_points) const {
  SurfaceChanges changes;
  changes.submap = kOnly;
  changes.side = kSide;
  changes.is_all = submap != kOnly || revision == 0 || revision > blocks_.size();
  changes.revision = changes.is_all ? 0 : revision;
  for (std::size_t points = 0; changes.revision < blocks_.size(); ++changes.revision) {
    const auto& block = blocks_[changes.revision];
    changes.has_more = points > 0 && points + block->points.size() > most_points;
    if (changes.has_more) break;
    points += block->points.size();
    changes.blocks.push_back(block);
  }
  return changes;
}

std::string RecordedView::image(std::uint64_t& number) {
  return std::exchange(number, 1) == 1 ? std::string() : image_;
}

std::vector<LogEntry> RecordedView::log(std::uint32_t since) const {
  return {log_.begin() + std::min<std::ptrdiff_t>(since, static_cast<std::ptrdiff_t>(log_.size())),
          log_.end()};
}

}  // namespace roslam::telemetry
