// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/voxel.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr std::uint8_t kInventedRank = 2;
constexpr float kSeenElsewhere = 0.5F;  // weight of what was carried over from other views

std::uint8_t rank_of(Provenance provenance) {
  if (provenance == Provenance::kMeasured) return 0;
  return provenance == Provenance::kReprojected ? 1 : kInventedRank;
}
}  // namespace

void Voxel::add(const VoxelReading& reading) {
  const std::uint8_t rank = rank_of(reading.provenance);
  if (weight_ > 0 && rank == kInventedRank && provenance_ != kInventedRank) return;
  if (provenance_ == kInventedRank && rank != kInventedRank) *this = Voxel{};
  const bool is_free = reading.distance >= 1.0F;
  const bool was_free = weight_ == 0 || distance() >= 1.0F;
  const bool was_before = !was_free && distance() > 0.0F;
  const float added = reading.weight * (rank == 0 ? 1.0F : kSeenElsewhere);
  const float sum = weight() + added;
  // A ray that passes before a surface on its way to another one tells that there is nothing, not how far the
  // surface is: who knows better is not contradicted.
  float share = added / sum;
  if (is_free && was_before) share = 0.0F;
  if (!is_free && reading.distance > 0.0F && was_free) share = 1.0F;
  distance_ = static_cast<std::int16_t>(
      std::lround((distance() + share * (reading.distance - distance())) * kDistanceUnit));
  if (!is_free) {
    provenance_ = (was_free ? rank : std::min<std::uint8_t>(rank, provenance_)) & 3U;
    paint(reading.colour, share);
    if (reading.label != kVoid) vote(reading.label);
  } else if (weight_ == 0) {
    provenance_ = rank & 3U;
  }
  const float unit = std::min(sum, kMaxWeight) * kWeightUnit;
  weight_ = static_cast<std::uint16_t>(std::max(1.0F, unit + 0.5F));
}

// What lies before a surface has no colour of its own.
void Voxel::paint(const cv::Vec3b& colour, float share) {
  const bool is_first = colour_ == decltype(colour_){};
  const cv::Vec3f before = this->colour();
  for (int c = 0; c < 3; ++c) {
    const auto taken = static_cast<float>(colour[c]);
    const float mean = is_first ? taken : before[c] + share * (taken - before[c]);
    colour_[static_cast<std::size_t>(c)] = static_cast<std::uint16_t>(mean * kColourUnit + 0.5F);
  }
}

// The majority of a stream in constant memory (Boyer and Moore 1991).
void Voxel::vote(std::uint8_t label) {
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
