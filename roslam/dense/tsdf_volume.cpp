// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/tsdf_volume.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "roslam/dense/local_planes.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 0.05F;    // metres in front of the camera
constexpr float kFarthest = 4.0e5F;  // metres from the origin, limit of block keys
constexpr int kTile = 8;             // pixels
constexpr float kBehind = 4.0F;      // truncations updated behind a surface along a ray at a grazing angle

// Inverse depth noise relative to that at 1 m; 0 without a reading.
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

// The largest depth of each tile of pixels, to cull blocks behind it.
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

// A keyframe at its pose, with local planes and weights of its pixels.
struct TsdfVolume::RangeImage {
  RangeImage(const DepthKeyframe& k, const SE3& T_world_camera, const MeasurementNoise& noise)
      : keyframe(k),
        planes(local_planes(k.depth, k.camera)),
        weights(weights_of(k.depth, noise.known_of({}, k.noise))),
        tiles(farthest_by_tile(k.depth)),
        world_from_camera(T_world_camera.rotation().toRotationMatrix().cast<float>()),
        camera_from_world(world_from_camera.transpose()),
        centre(T_world_camera.translation().cast<float>()),
        fx(static_cast<float>(k.camera.fx)),
        fy(static_cast<float>(k.camera.fy)),
        cx(static_cast<float>(k.camera.cx)),
        cy(static_cast<float>(k.camera.cy)) {}

  Eigen::Vector3f to_camera(const Eigen::Vector3f& point) const {
    return camera_from_world * (point - centre);
  }

  // Whether a ball (camera frame, metres) may overlap space in front of the surfaces or up to `behind` them.
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

  const DepthKeyframe& keyframe;
  cv::Mat planes, weights, tiles;
  Eigen::Matrix3f world_from_camera, camera_from_world;
  Eigen::Vector3f centre;
  float fx, fy, cx, cy;
};

TsdfVolume::TsdfVolume(double voxel_size, const DenseOptions& options, const MeasurementNoise& noise)
    : voxel_size_(static_cast<float>(voxel_size)),
      truncation_(static_cast<float>(voxel_size * options.truncation)),
      noise_(noise) {}

Eigen::Vector3f TsdfVolume::centre(const BlockKey& key, int x, int y, int z) const {
  const Eigen::Vector3f index(static_cast<float>(key.x * kBlockSide + x),
                              static_cast<float>(key.y * kBlockSide + y),
                              static_cast<float>(key.z * kBlockSide + z));
  return (index + Eigen::Vector3f::Constant(0.5F)) * voxel_size_;
}

BlockKey TsdfVolume::key_of(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f scaled = (point / (voxel_size_ * kBlockSide)).array().floor();
  return {static_cast<std::int32_t>(scaled.x()), static_cast<std::int32_t>(scaled.y()),
          static_cast<std::int32_t>(scaled.z())};
}

const Block* TsdfVolume::find(const BlockKey& key) const {
  const auto found = blocks_.find(key);
  return found == blocks_.end() ? nullptr : found->second.get();
}

std::vector<BlockKey> TsdfVolume::keys() const {
  std::vector<BlockKey> result;
  result.reserve(blocks_.size());
  for (const auto& [key, block] : blocks_) result.push_back(key);
  std::sort(result.begin(), result.end());
  return result;
}

void TsdfVolume::replace(const BlockSet& blocks, TsdfVolume other) {
  for (const BlockKey& key : blocks) blocks_.erase(key);
  blocks_.merge(other.blocks_);
}

// Blocks around the surfaces of the keyframe.
BlockSet TsdfVolume::surface_blocks(const RangeImage& image) const {
  BlockSet result;
  std::optional<BlockKey> last;
  for (int y = 0; y < image.keyframe.depth.rows; ++y) {
    for (int x = 0; x < image.keyframe.depth.cols; ++x) {
      const float depth = image.keyframe.depth.at<float>(y, x);
      if (!(depth > 0.0F)) continue;
      const Eigen::Vector3f in_camera((static_cast<float>(x) - image.cx) / image.fx * depth,
                                      (static_cast<float>(y) - image.cy) / image.fy * depth, depth);
      const Eigen::Vector3f point = image.world_from_camera * in_camera + image.centre;
      if (!(point.cwiseAbs().maxCoeff() < kFarthest)) continue;
      const auto& plane = image.planes.at<cv::Vec4f>(y, x);
      const Eigen::Vector3f normal = image.world_from_camera * Eigen::Vector3f(plane[0], plane[1], plane[2]);
      for (const float step : {0.0F, -0.5F, 0.5F}) {
        const BlockKey key = key_of(point + step * truncation_ * normal);
        if (last != key) result.insert(key);
        last = key;
      }
    }
  }
  return result;
}

void TsdfVolume::update(Block& block, const RangeImage& image) const {
  const Eigen::Vector3f step = image.camera_from_world.col(0) * voxel_size_;
  const float per_truncation = 1.0F / truncation_;
  const auto columns = static_cast<float>(image.keyframe.depth.cols),
             rows = static_cast<float>(image.keyframe.depth.rows);
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      Eigen::Vector3f point = image.to_camera(centre(block.key, 0, y, z)) - step;
      for (int x = 0; x < kBlockSide; ++x) {
        point += step;
        if (point.z() < kNearest) continue;
        const float u = point.x() / point.z() * image.fx + image.cx + 0.5F;
        const float v = point.y() / point.z() * image.fy + image.cy + 0.5F;
        if (!(u >= 0.0F && v >= 0.0F && u < columns && v < rows)) continue;
        const int column = static_cast<int>(u), row = static_cast<int>(v);
        const float weight = image.weights.at<float>(row, column);
        if (weight == 0.0F) continue;
        const auto& plane = image.planes.at<cv::Vec4f>(row, column);
        const float before = plane[3] - (plane[0] * point.x() + plane[1] * point.y() + plane[2] * point.z());
        const float distance = before * per_truncation;
        if (distance < -1.0F) continue;
        block.voxels[Block::index(x, y, z)].add(
            {std::min(distance, 1.0F), weight, image.keyframe.colour.at<cv::Vec3b>(row, column),
             image.keyframe.labels.at<std::uint8_t>(row, column),
             static_cast<Provenance>(image.keyframe.provenance.at<std::uint8_t>(row, column))});
      }
    }
  }
}

std::vector<Block*> TsdfVolume::blocks_in_reach(const RangeImage& image) const {
  const float half = 0.5F * voxel_size_ * kBlockSide;
  const float radius = half * std::sqrt(3.0F);
  std::vector<Block*> result;
  for (const auto& [key, block] : blocks_) {
    const Eigen::Vector3f middle =
        centre(key, 0, 0, 0) + Eigen::Vector3f::Constant(half - 0.5F * voxel_size_);
    if (image.reaches(image.to_camera(middle), radius, kBehind * truncation_)) result.push_back(block.get());
  }
  return result;
}

void TsdfVolume::integrate(const DepthKeyframe& keyframe, const SE3& T_world_camera, const BlockSet* within) {
  const RangeImage image(keyframe, T_world_camera, noise_);
  for (const BlockKey& key : surface_blocks(image)) {
    if (within != nullptr && !within->contains(key)) continue;
    auto& block = blocks_[key];
    if (block) continue;
    block = std::make_unique<Block>();
    block->key = key;
  }
  for (Block* block : blocks_in_reach(image))
    if (within == nullptr || within->contains(block->key)) update(*block, image);
}

BlockSet TsdfVolume::affected_blocks(const DepthKeyframe& keyframe, const SE3& T_world_camera) const {
  const RangeImage image(keyframe, T_world_camera, noise_);
  BlockSet result = surface_blocks(image);
  for (const Block* block : blocks_in_reach(image)) result.insert(block->key);
  return result;
}

}  // namespace roslam
