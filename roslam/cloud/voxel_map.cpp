// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/voxel_map.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "roslam/cloud/local_planes.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 0.05F;    // metres before the camera
constexpr float kFarthest = 4.0e5F;  // metres from the origin that blocks are numbered to
constexpr int kTile = 8;             // pixels
constexpr float kBehind = 4.0F;  // truncations behind a surface, along a flat ray, that distances are kept

// Of readings by their noise; 0 where there is none.
cv::Mat weights_of(const cv::Mat& depth, const MeasurementNoise& noise) {
  const double reference = noise.sigma_of_depth(1.0);
  cv::Mat weights = cv::Mat::zeros(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const double z = static_cast<double>(depth.at<float>(y, x));
      if (z > 0.0) weights.at<float>(y, x) = static_cast<float>(reference / noise.sigma_of_depth(z));
    }
  }
  return weights;
}

// The farthest depth in squares of pixels, to pass over what lies behind all of it.
cv::Mat farthest_by_tile(const cv::Mat& depth) {
  cv::Mat tiles =
      cv::Mat::zeros((depth.rows + kTile - 1) / kTile, (depth.cols + kTile - 1) / kTile, CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    float* tile = tiles.ptr<float>(y / kTile);
    for (int x = 0; x < depth.cols; ++x) tile[x / kTile] = std::max(tile[x / kTile], row[x]);
  }
  return tiles;
}
}  // namespace

// A view at its pose, prepared.
struct VoxelMap::Sight {
  Sight(const DenseView& v, const SE3& T_world_camera, const MeasurementNoise& noise)
      : view(v),
        planes(local_planes(v.depth, v.camera)),
        weights(weights_of(v.depth, noise)),
        tiles(farthest_by_tile(v.depth)),
        world_from_camera(T_world_camera.rotation().toRotationMatrix().cast<float>()),
        camera_from_world(world_from_camera.transpose()),
        centre(T_world_camera.translation().cast<float>()),
        fx(static_cast<float>(v.camera.fx)),
        fy(static_cast<float>(v.camera.fy)),
        cx(static_cast<float>(v.camera.cx)),
        cy(static_cast<float>(v.camera.cy)) {}

  Eigen::Vector3f to_camera(const Eigen::Vector3f& point) const {
    return camera_from_world * (point - centre);
  }

  // Whether a ball (camera frame, metres) may lie, in part, before what the view shows or just behind it.
  bool reaches(const Eigen::Vector3f& ball, float radius, float behind) const {
    if (ball.z() + radius < kNearest) return false;
    const float near = std::max(ball.z() - radius, kNearest);
    const float reach = radius / near;
    const float x = ball.x() / std::max(ball.z(), kNearest), y = ball.y() / std::max(ball.z(), kNearest);
    const int left = tile_of((x - 2.0F * reach) * fx + cx, tiles.cols);
    const int right = tile_of((x + 2.0F * reach) * fx + cx, tiles.cols);
    const int top = tile_of((y - 2.0F * reach) * fy + cy, tiles.rows);
    const int bottom = tile_of((y + 2.0F * reach) * fy + cy, tiles.rows);
    float farthest = 0.0F;
    for (int r = std::max(top, 0); r <= std::min(bottom, tiles.rows - 1); ++r)
      for (int c = std::max(left, 0); c <= std::min(right, tiles.cols - 1); ++c)
        farthest = std::max(farthest, tiles.at<float>(r, c));
    return farthest > 0.0F && ball.z() - radius <= farthest + behind;
  }

  static int tile_of(float pixel, int tiles) {
    const auto limit = static_cast<float>((tiles + 1) * kTile);
    return static_cast<int>(std::floor(std::clamp(pixel, -limit, limit) / kTile));
  }

  const DenseView& view;
  cv::Mat planes, weights, tiles;
  Eigen::Matrix3f world_from_camera, camera_from_world;
  Eigen::Vector3f centre;
  float fx, fy, cx, cy;
};

VoxelMap::VoxelMap(double voxel_size, const DenseOptions& options, const MeasurementNoise& noise)
    : voxel_size_(static_cast<float>(voxel_size)),
      truncation_(static_cast<float>(voxel_size * options.truncation)),
      noise_(noise) {}

Eigen::Vector3f VoxelMap::centre(const BlockKey& key, int x, int y, int z) const {
  const Eigen::Vector3f place(static_cast<float>(key.x * kBlockSide + x),
                              static_cast<float>(key.y * kBlockSide + y),
                              static_cast<float>(key.z * kBlockSide + z));
  return (place + Eigen::Vector3f::Constant(0.5F)) * voxel_size_;
}

BlockKey VoxelMap::key_of(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f scaled = (point / (voxel_size_ * kBlockSide)).array().floor();
  return {static_cast<std::int32_t>(scaled.x()), static_cast<std::int32_t>(scaled.y()),
          static_cast<std::int32_t>(scaled.z())};
}

const Block* VoxelMap::find(const BlockKey& key) const {
  const auto found = blocks_.find(key);
  return found == blocks_.end() ? nullptr : found->second.get();
}

std::vector<BlockKey> VoxelMap::keys() const {
  std::vector<BlockKey> result;
  result.reserve(blocks_.size());
  for (const auto& [key, block] : blocks_) result.push_back(key);
  std::sort(result.begin(), result.end());
  return result;
}

void VoxelMap::erase(const BlockSet& blocks) {
  for (const BlockKey& key : blocks) blocks_.erase(key);
}

// About the surfaces of the view.
BlockSet VoxelMap::surface_blocks(const Sight& sight) const {
  BlockSet result;
  std::optional<BlockKey> last;
  for (int y = 0; y < sight.view.depth.rows; ++y) {
    for (int x = 0; x < sight.view.depth.cols; ++x) {
      const float depth = sight.view.depth.at<float>(y, x);
      if (!(depth > 0.0F)) continue;
      const Eigen::Vector3f in_camera((static_cast<float>(x) - sight.cx) / sight.fx * depth,
                                      (static_cast<float>(y) - sight.cy) / sight.fy * depth, depth);
      const Eigen::Vector3f point = sight.world_from_camera * in_camera + sight.centre;
      if (!(point.cwiseAbs().maxCoeff() < kFarthest)) continue;
      const auto& plane = sight.planes.at<cv::Vec4f>(y, x);
      const Eigen::Vector3f normal = sight.world_from_camera * Eigen::Vector3f(plane[0], plane[1], plane[2]);
      for (const float step : {0.0F, -0.5F, 0.5F}) {
        const BlockKey key = key_of(point + step * truncation_ * normal);
        if (last != key) result.insert(key);
        last = key;
      }
    }
  }
  return result;
}

void VoxelMap::update(Block& block, const Sight& sight) const {
  const Eigen::Vector3f step = sight.camera_from_world.col(0) * voxel_size_;
  const float per_truncation = 1.0F / truncation_;
  const auto columns = static_cast<float>(sight.view.depth.cols),
             rows = static_cast<float>(sight.view.depth.rows);
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      Eigen::Vector3f point = sight.to_camera(centre(block.key, 0, y, z)) - step;
      for (int x = 0; x < kBlockSide; ++x) {
        point += step;
        if (point.z() < kNearest) continue;
        const float u = point.x() / point.z() * sight.fx + sight.cx + 0.5F;
        const float v = point.y() / point.z() * sight.fy + sight.cy + 0.5F;
        if (!(u >= 0.0F && v >= 0.0F && u < columns && v < rows)) continue;
        const int column = static_cast<int>(u), row = static_cast<int>(v);
        const float weight = sight.weights.at<float>(row, column);
        if (weight == 0.0F) continue;
        const auto& plane = sight.planes.at<cv::Vec4f>(row, column);
        const float before = plane[3] - (plane[0] * point.x() + plane[1] * point.y() + plane[2] * point.z());
        const float distance = before * per_truncation;
        if (distance < -1.0F) continue;
        block.voxels[Block::index(x, y, z)].add(
            {std::min(distance, 1.0F), weight, sight.view.colour.at<cv::Vec3b>(row, column),
             sight.view.labels.at<std::uint8_t>(row, column),
             static_cast<Provenance>(sight.view.provenance.at<std::uint8_t>(row, column))});
      }
    }
  }
}

std::vector<Block*> VoxelMap::reached_by(const Sight& sight) const {
  const float half = 0.5F * voxel_size_ * kBlockSide;
  const float radius = half * std::sqrt(3.0F);
  std::vector<Block*> result;
  for (const auto& [key, block] : blocks_) {
    const Eigen::Vector3f middle =
        centre(key, 0, 0, 0) + Eigen::Vector3f::Constant(half - 0.5F * voxel_size_);
    if (sight.reaches(sight.to_camera(middle), radius, kBehind * truncation_)) result.push_back(block.get());
  }
  return result;
}

void VoxelMap::integrate(const DenseView& view, const SE3& T_world_camera, const BlockSet* within) {
  const Sight sight(view, T_world_camera, noise_);
  for (const BlockKey& key : surface_blocks(sight)) {
    if (within != nullptr && !within->contains(key)) continue;
    auto& block = blocks_[key];
    if (block) continue;
    block = std::make_unique<Block>();
    block->key = key;
  }
  for (Block* block : reached_by(sight))
    if (within == nullptr || within->contains(block->key)) update(*block, sight);
}

BlockSet VoxelMap::reached(const DenseView& view, const SE3& T_world_camera) const {
  const Sight sight(view, T_world_camera, noise_);
  BlockSet result = surface_blocks(sight);
  for (const Block* block : reached_by(sight)) result.insert(block->key);
  return result;
}

}  // namespace roslam
