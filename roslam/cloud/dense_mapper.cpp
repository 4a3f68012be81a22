// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/dense_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "roslam/cloud/visibility_check.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/upper_median.hpp"

namespace roslam {

namespace {
constexpr double kIndoors = 4.0;                        // metres, typical depth of a view in a room at most
constexpr double kFineVoxel = 0.02, kWideVoxel = 0.05;  // metres

// Nothing in a view without depth.
std::optional<double> typical_depth(const cv::Mat& depth) {
  std::vector<float> known;
  constexpr int kEvery = 4;  // pixels
  for (int y = 0; y < depth.rows; y += kEvery)
    for (int x = 0; x < depth.cols; x += kEvery)
      if (depth.at<float>(y, x) > 0.0F) known.push_back(depth.at<float>(y, x));
  if (known.empty()) return std::nullopt;
  return static_cast<double>(upper_median(known));
}
}  // namespace

void DenseOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("dense.") + message);
  };
  require(voxel_size == 0.0 || (voxel_size >= 0.001 && voxel_size <= 10.0),
          "voxel_size must be 0 (chosen by the first view) or 0.001 to 10 metres");
  require(max_depth > 0.0 && max_depth <= 65.0, "max_depth must be above 0 and at most 65 metres");
  require(stride >= 1 && stride <= 16, "stride must be 1 to 16 pixels");
  require(truncation >= 2.0 && truncation <= 20.0, "truncation must be 2 to 20 voxels");
  require(min_weight >= 0.0 && min_weight <= 60.0, "min_weight must be 0 to 60");
  require(follow > 0.0 && follow <= 100.0, "follow must be above 0 and at most 100 voxels");
  require(follow_every >= 1 && follow_every <= 100000, "follow_every must be 1 to 100000 keyframes");
  require(queue >= 1 && queue <= 10000, "queue must be 1 to 10000 keyframes");
  require(max_memory >= 16 && max_memory <= 1000000, "max_memory must be 16 to 1000000 MB");
}

DenseMapper::DenseMapper(const DenseOptions& options, const MeasurementNoise& noise)
    : options_(options), noise_(noise), voxel_size_(options.voxel_size) {
  options.validate();
  noise.validate();
}

VoxelMap& DenseMapper::map_of(WorldId world) {
  return maps_.try_emplace(world, voxel_size_, options_, noise_).first->second;
}

void DenseMapper::insert(KeyframeId id, const DenseView& view, const KeyframePlace& place) {
  const auto depth = typical_depth(view.depth);
  if (!depth || !place.T_world_camera.is_finite()) return;
  if (voxel_size_ == 0.0) voxel_size_ = *depth < kIndoors ? kFineVoxel : kWideVoxel;
  Fused fused{pack(view), place, *depth};
  map_of(place.world).integrate(unpack(fused.view), place.T_world_camera);
  view_bytes_ += fused.view.bytes();
  fused_.insert_or_assign(id, std::move(fused));
  limit_memory();
}

// How far a point at the view's typical depth went.
bool DenseMapper::has_moved(const Fused& fused, const KeyframePlace& place, double share) const {
  if (!place.T_world_camera.is_finite()) return false;
  if (fused.place.world != place.world) return true;
  const SE3 motion = fused.place.T_world_camera.inverse() * place.T_world_camera;
  const double moved = motion.translation().norm() + motion.angle() * fused.depth;
  return moved > share * options_.follow * voxel_size_;
}

std::size_t DenseMapper::follow(const std::map<KeyframeId, KeyframePlace>& places, double share) {
  std::map<WorldId, BlockSet> stale;
  std::vector<const std::pair<const KeyframeId, KeyframePlace>*> moved;
  for (const auto& [id, fused] : fused_) {
    const auto place = places.find(id);
    if (place == places.end() || !has_moved(fused, place->second, share)) continue;
    const DenseView view = unpack(fused.view);
    stale[fused.place.world].merge(map_of(fused.place.world).reached(view, fused.place.T_world_camera));
    const auto& [world, T_world_camera] = place->second;
    stale[world].merge(map_of(world).reached(view, T_world_camera));
    moved.push_back(&*place);
  }
  for (const auto* place : moved) fused_.at(place->first).place = place->second;
  for (const auto& [world, blocks] : stale) fuse_again(world, blocks);
  limit_memory();
  return moved.size();
}

void DenseMapper::fuse_again(WorldId world, const BlockSet& blocks) {
  VoxelMap& map = map_of(world);
  map.erase(blocks);
  for (const auto& [id, fused] : fused_) {
    if (fused.place.world != world || !may_reach(fused, map, blocks)) continue;
    map.integrate(unpack(fused.view), fused.place.T_world_camera, &blocks);
  }
  if (map.blocks() == 0) maps_.erase(world);
}

// Whether any of the blocks is within the farthest depth that is fused.
bool DenseMapper::may_reach(const Fused& fused, const VoxelMap& map, const BlockSet& blocks) const {
  const Eigen::Vector3f centre = fused.place.T_world_camera.translation().cast<float>();
  const float side = kBlockSide * map.voxel_size();
  // A ray to the corner of a picture is longer than it is deep.
  const Camera& camera = fused.view.camera;
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
    maps_.clear();
    for (const auto& [id, fused] : fused_)
      map_of(fused.place.world).integrate(unpack(fused.view), fused.place.T_world_camera);
  }
}

std::size_t DenseMapper::voxel_bytes() const {
  std::size_t sum = 0;
  for (const auto& [world, map] : maps_) sum += map.bytes();
  return sum;
}

std::vector<KeyframeId> DenseMapper::keyframes() const {
  std::vector<KeyframeId> result;
  for (const auto& [id, fused] : fused_) result.push_back(id);
  return result;
}

const VoxelMap* DenseMapper::map(WorldId world) const {
  const auto found = maps_.find(world);
  return found == maps_.end() ? nullptr : &found->second;
}

Surface DenseMapper::surface(WorldId world) const {
  const VoxelMap* voxels = map(world);
  if (voxels == nullptr) return {};
  const Surface surface = extract_surface(*voxels, options_);
  VisibilityCheck check(surface, voxel_size_, noise_);
  visit(world, [&](const DenseView& view, const SE3& T_world_camera) { check.ask(view, T_world_camera); });
  return kept(surface, check.confirmed());
}

void DenseMapper::visit(
    WorldId world, const std::function<void(const DenseView&, const SE3& T_world_camera)>& visitor) const {
  for (const auto& [id, fused] : fused_)
    if (fused.place.world == world) visitor(unpack(fused.view), fused.place.T_world_camera);
}

}  // namespace roslam
