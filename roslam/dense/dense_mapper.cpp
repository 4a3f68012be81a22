// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/dense_mapper.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"
#include "roslam/dense/visibility_check.hpp"

namespace roslam {

namespace {
constexpr double kIndoors = 4.0;                        // metres, median depth below which a scene is indoors
constexpr double kFineVoxel = 0.02, kWideVoxel = 0.05;  // metres

// Median depth; nothing without depth.
std::optional<double> median_depth(const cv::Mat& depth) {
  std::vector<float> known;
  constexpr int kStride = 4;  // pixels
  for (int y = 0; y < depth.rows; y += kStride)
    for (int x = 0; x < depth.cols; x += kStride)
      if (depth.at<float>(y, x) > 0.0F) known.push_back(depth.at<float>(y, x));
  if (known.empty()) return std::nullopt;
  return static_cast<double>(upper_median(known));
}
}  // namespace

DenseMapper::DenseMapper(const DenseOptions& options, const MeasurementNoise& noise)
    : options_(options), noise_(noise), voxel_size_(options.voxel_size) {
  options.validate();
  noise.validate();
}

TsdfVolume& DenseMapper::map_of(SubmapId submap) {
  return maps_.try_emplace(submap, voxel_size_, options_, noise_).first->second;
}

void DenseMapper::insert(KeyframeId id, const DepthKeyframe& keyframe, const KeyframePose& pose) {
  const auto depth = median_depth(keyframe.depth);
  if (!depth || !pose.T_world_camera.is_finite() || !pose.submap.is_valid()) return;
  if (voxel_size_ == 0.0) voxel_size_ = *depth < kIndoors ? kFineVoxel : kWideVoxel;
  Fused fused{pack(keyframe), pose, *depth};
  const DepthKeyframe unpacked = unpack(fused.keyframe);
  map_of(pose.submap).integrate(unpacked, pose.T_world_camera);
  if (changes_.are_kept) {
    changes_.before.try_emplace(id);
    changes_.blocks[pose.submap].merge(map_of(pose.submap).affected_blocks(unpacked, pose.T_world_camera));
  }
  view_bytes_ += fused.keyframe.bytes();
  fused_.insert_or_assign(id, std::move(fused));
  limit_memory();
}

// Compares the displacement of a point at the keyframe's median depth.
bool DenseMapper::has_moved(const Fused& fused, const KeyframePose& pose, double share) const {
  if (!pose.T_world_camera.is_finite()) return false;
  if (fused.pose.submap != pose.submap) return true;
  const SE3 motion = fused.pose.T_world_camera.inverse() * pose.T_world_camera;
  const double moved = motion.translation().norm() + motion.angle() * fused.depth;
  return moved > share * options_.follow * voxel_size_;
}

std::size_t DenseMapper::follow(const std::map<KeyframeId, KeyframePose>& poses, double share,
                                const std::function<bool()>& should_stop) {
  const std::size_t moved = note_moved(poses, share);
  while (!stale_.empty()) {
    const auto& [submap, blocks] = *stale_.begin();
    if (!reintegrate(submap, blocks, should_stop)) return moved;
    if (changes_.are_kept) changes_.blocks[submap].insert(blocks.begin(), blocks.end());
    stale_.erase(stale_.begin());
  }
  limit_memory();
  return moved;
}

// The blocks that a moved keyframe changed, and will change, become stale.
std::size_t DenseMapper::note_moved(const std::map<KeyframeId, KeyframePose>& poses, double share) {
  std::vector<KeyframeId> withdrawn;
  std::size_t moved = 0;
  for (auto& [id, fused] : fused_) {
    const auto pose = poses.find(id);
    if (pose == poses.end() || !has_moved(fused, pose->second, share)) continue;
    const DepthKeyframe unpacked = unpack(fused.keyframe);
    const auto note = [&](const KeyframePose& at) {
      stale_[at.submap].merge(map_of(at.submap).affected_blocks(unpacked, at.T_world_camera));
    };
    ++moved;
    note(fused.pose);
    if (!pose->second.submap.is_valid()) {
      withdrawn.push_back(id);
      continue;
    }
    note(pose->second);
    if (changes_.are_kept) changes_.before.try_emplace(id, fused.pose);
    fused.pose = pose->second;
  }
  for (const KeyframeId id : withdrawn) withdraw(id);
  return moved;
}

void DenseMapper::withdraw(KeyframeId id) {
  const auto found = fused_.find(id);
  view_bytes_ -= found->second.keyframe.bytes();
  if (changes_.are_kept) {
    changes_.before.try_emplace(id, found->second.pose);
    changes_.gone.try_emplace(id, std::move(found->second));
  }
  fused_.erase(found);
}

// The blocks are made anew beside the map and replace those in it once they are whole. Returns false if it
// was stopped before.
bool DenseMapper::reintegrate(SubmapId submap, const BlockSet& blocks,
                              const std::function<bool()>& should_stop) {
  TsdfVolume& map = map_of(submap);
  TsdfVolume anew(voxel_size_, options_, noise_);
  for (const auto& [id, fused] : fused_) {
    if (fused.pose.submap != submap || !is_in_reach(fused, map, blocks)) continue;
    if (should_stop && should_stop()) return false;
    anew.integrate(unpack(fused.keyframe), fused.pose.T_world_camera, &blocks);
  }
  map.replace(blocks, std::move(anew));
  if (map.blocks() == 0) maps_.erase(submap);
  return true;
}

// Whether any of the blocks is within the largest fused depth.
bool DenseMapper::is_in_reach(const Fused& fused, const TsdfVolume& map, const BlockSet& blocks) const {
  const Eigen::Vector3f centre = fused.pose.T_world_camera.translation().cast<float>();
  const float side = kBlockSide * map.voxel_size();
  // The ray to an image corner is longer than its depth along the optical axis.
  const Camera& camera = fused.keyframe.camera;
  const Eigen::Vector3d corner(std::max(camera.cx, camera.width - camera.cx) / camera.fx,
                               std::max(camera.cy, camera.height - camera.cy) / camera.fy, 1.0);
  const float reach = static_cast<float>(corner.norm() * options_.max_depth) + 2.0F * side;
  return std::any_of(blocks.begin(), blocks.end(), [&](const BlockKey& key) {
    return (map.centre(key, 0, 0, 0) - centre).squaredNorm() <= reach * reach;
  });
}

void DenseMapper::limit_memory() {
  constexpr std::size_t kMegabyte = 1000000;
  while (voxel_bytes() > static_cast<std::size_t>(options_.max_memory) * kMegabyte) {
    voxel_size_ *= 2.0;
    ++times_coarsened_;
    changes_ = {};
    maps_.clear();
    stale_.clear();
    for (const auto& [id, fused] : fused_)
      map_of(fused.pose.submap).integrate(unpack(fused.keyframe), fused.pose.T_world_camera);
  }
}

DenseChanges DenseMapper::take_changes() {
  if (voxel_size_ == 0.0) return {};  // nothing was fused yet
  Changes taken = std::exchange(changes_, {});
  changes_.are_kept = true;
  if (!taken.are_kept) return all();
  DenseChanges result;
  result.blocks = std::move(taken.blocks);
  for (const auto& [id, before] : taken.before) {
    if (const auto fused = fused_.find(id); fused != fused_.end()) {
      result.keyframes.push_back({id, before, fused->second.pose, {}});
    } else if (const auto gone = taken.gone.find(id); gone != taken.gone.end() && before.submap.is_valid()) {
      result.keyframes.push_back({id, before, {}, std::move(gone->second.keyframe)});
    }
  }
  return result;
}

DenseChanges DenseMapper::all() const {
  DenseChanges result;
  result.is_all = true;
  for (const auto& [id, fused] : fused_) result.keyframes.push_back({id, {}, fused.pose, {}});
  for (const auto& [submap, map] : maps_) {
    for (const BlockKey& key : map.keys()) result.blocks[submap].insert(key);
  }
  return result;
}

std::size_t DenseMapper::voxel_bytes() const {
  std::size_t sum = 0;
  for (const auto& [submap, map] : maps_) sum += map.bytes();
  return sum;
}

std::vector<KeyframeId> DenseMapper::keyframes() const {
  std::vector<KeyframeId> result;
  for (const auto& [id, fused] : fused_) result.push_back(id);
  return result;
}

const TsdfVolume* DenseMapper::map(SubmapId submap) const {
  const auto found = maps_.find(submap);
  return found == maps_.end() ? nullptr : &found->second;
}

SurfaceMap DenseMapper::surface(SubmapId submap) const { return *surface(submap, {}); }

std::optional<SurfaceMap> DenseMapper::surface(SubmapId submap,
                                               const std::function<bool()>& should_stop) const {
  const TsdfVolume* voxels = map(submap);
  if (voxels == nullptr) return SurfaceMap{};
  const SurfaceMap surface = extract_surface(*voxels, options_);
  VisibilityCheck check(surface, voxel_size_, noise_);
  for (const auto& [id, fused] : fused_) {
    if (should_stop && should_stop()) return std::nullopt;
    if (fused.pose.submap == submap) check.ask(unpack(fused.keyframe), fused.pose.T_world_camera);
  }
  return filter_points(surface, check.confirmed());
}

void DenseMapper::visit(
    SubmapId submap,
    const std::function<void(const DepthKeyframe&, const SE3& T_world_camera)>& visitor) const {
  for (const auto& [id, fused] : fused_)
    if (fused.pose.submap == submap) visitor(unpack(fused.keyframe), fused.pose.T_world_camera);
}

}  // namespace roslam
