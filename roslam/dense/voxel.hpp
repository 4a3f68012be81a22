// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

#include "roslam/restoration/provenance.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

/// One observation of a voxel.
struct VoxelReading {
  float distance;  ///< signed, in truncations, -1 to 1, positive in front of the surface; 1: free
  float weight;    ///< 1 for a reading at 1 m
  cv::Vec3b colour;
  std::uint8_t label;
  Provenance provenance;
};

/// A TSDF voxel: weighted means of its readings, in fixed point to save memory. Inpainted readings are
/// discarded as soon as a measured or reprojected one is added, also one of free space.
class Voxel {
 public:
  void add(const VoxelReading& reading);

  bool is_known() const { return weight_ > 0; }
  float weight() const { return static_cast<float>(weight_) / kWeightUnit; }
  float distance() const { return static_cast<float>(distance_) / kDistanceUnit; }
  cv::Vec3f colour() const {
    return {static_cast<float>(colour_[0]) / kColourUnit, static_cast<float>(colour_[1]) / kColourUnit,
            static_cast<float>(colour_[2]) / kColourUnit};
  }
  std::uint8_t label() const { return label_; }  ///< majority label of the readings, or kVoid
  /// The best provenance (measured first) of the readings near the surface.
  Provenance provenance() const { return kProvenances[provenance_]; }

  bool operator==(const Voxel&) const = default;

 private:
  static constexpr float kWeightUnit = 512.0F, kDistanceUnit = 32767.0F, kColourUnit = 256.0F;
  static constexpr float kMaxWeight = 64.0F;  // so that the map adapts to changes of the scene
  static constexpr std::array kProvenances{Provenance::kMeasured, Provenance::kReprojected,
                                           Provenance::kInpainted};

  void add_colour(const cv::Vec3b& colour, float share);
  void add_label(std::uint8_t label);

  std::int16_t distance_ = 0;
  std::uint16_t weight_ = 0;
  std::array<std::uint16_t, 3> colour_{};  // BGR
  std::uint8_t label_ = kVoid;
  std::uint8_t votes_ : 6 = 0;  // lead of the label
  std::uint8_t provenance_ : 2 = 0;
};

inline constexpr int kBlockSide = 8;
inline constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

/// Block coordinates: in block sides, from the world origin.
struct BlockKey {
  std::int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const BlockKey&) const = default;
};

struct BlockKeyHash {
  std::size_t operator()(const BlockKey& key) const {
    const auto mixed = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.x)) * 0x9e3779b97f4a7c15ULL ^
                       static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.y)) * 0xc2b2ae3d27d4eb4fULL ^
                       static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.z)) * 0x165667b19e3779f9ULL;
    return static_cast<std::size_t>(mixed ^ mixed >> 29);
  }
};

/// A cube of voxels; x runs fastest, then y.
struct Block {
  BlockKey key;
  std::array<Voxel, kBlockVoxels> voxels;

  static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>((z * kBlockSide + y) * kBlockSide + x);
  }
};

}  // namespace roslam
