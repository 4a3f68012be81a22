// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/voxel.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr std::uint8_t kInpaintedRank = 2;
constexpr float kUnmeasuredWeight = 0.5F;  // factor for reprojected and inpainted readings

std::uint8_t rank_of(Provenance provenance) {
  if (provenance == Provenance::kMeasured) return 0;
  return provenance == Provenance::kReprojected ? 1 : kInpaintedRank;
}
}  // namespace

void Voxel::add(const VoxelReading& reading) {
  const std::uint8_t rank = rank_of(reading.provenance);
  if (weight_ > 0 && rank == kInpaintedRank && provenance_ != kInpaintedRank) return;
  if (provenance_ == kInpaintedRank && rank != kInpaintedRank) *this = Voxel{};
  const bool is_free = reading.distance >= 1.0F;
  const bool was_free = weight_ == 0 || distance() >= 1.0F;
  const bool was_before = !was_free && distance() > 0.0F;
  const float added = reading.weight * (rank == 0 ? 1.0F : kUnmeasuredWeight);
  const float sum = weight() + added;
  // A free reading in front of a known surface is of a ray that passes by: it tells that the voxel is free,
  // not the distance to the surface, and does not change a known distance.
  float share = added / sum;
  if (is_free && was_before) share = 0.0F;
  if (!is_free && reading.distance > 0.0F && was_free) share = 1.0F;
  distance_ = static_cast<std::int16_t>(
      std::lround((distance() + share * (reading.distance - distance())) * kDistanceUnit));
  if (!is_free) {
    provenance_ = (was_free ? rank : std::min<std::uint8_t>(rank, provenance_)) & 3U;
    add_colour(reading.colour, share);
    if (reading.label != kVoid) add_label(reading.label);
  } else if (weight_ == 0) {
    provenance_ = rank & 3U;
  }
  const float unit = std::min(sum, kMaxWeight) * kWeightUnit;
  weight_ = static_cast<std::uint16_t>(std::max(1.0F, unit + 0.5F));
}

// Free voxels have no colour: the first reading near a surface sets it.
void Voxel::add_colour(const cv::Vec3b& colour, float share) {
  const bool is_first = colour_ == decltype(colour_){};
  const cv::Vec3f before = this->colour();
  for (int c = 0; c < 3; ++c) {
    const auto taken = static_cast<float>(colour[c]);
    const float mean = is_first ? taken : before[c] + share * (taken - before[c]);
    colour_[static_cast<std::size_t>(c)] = static_cast<std::uint16_t>(mean * kColourUnit + 0.5F);
  }
}

// Majority vote of a stream in constant memory (Boyer and Moore 1991).
void Voxel::add_label(std::uint8_t label) {
  constexpr int kMostVotes = 63;
  if (label == label_) {
    if (votes_ < kMostVotes) ++votes_;
  } else if (votes_ > 0) {
    --votes_;
  } else {
    label_ = label;
    votes_ = 1;
  }
}

}  // namespace roslam
