// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/warp_group.hpp"

#include <cmath>

namespace roslam {

namespace {
// Angle with a cosine, radians, to 2e-7: Abramowitz, Stegun: "Handbook of Mathematical Functions", 4.4.46.
Four angle_of(const Four& cosine) {
  const Four c = cosine.abs().min(1.0F);
  Four sum = Four::Constant(-0.0012624911F);
  for (const float factor : {0.0066700901F, -0.0170881256F, 0.0308918810F, -0.0501743046F, 0.0889789874F,
                             -0.2145988016F, 1.5707963050F})
    sum = sum * c + factor;
  const Four angle = (1.0F - c).sqrt() * sum;
  return (cosine < 0.0F).select(static_cast<float>(M_PI) - angle, angle);
}
}  // namespace

WarpGroup::WarpGroup(const PixelRays& rays, const std::vector<SourceWarp>& warps)
    : rays_(rays),
      all_(warps),
      fours_(fours_for(warps.size())),
      x_(fours_.size()),
      y_(fours_.size()),
      depth_(fours_.size()),
      warped_(warps.size()),
      weights_(fours_.size()) {
  for (std::size_t i = 0; i < 4 * fours_.size(); ++i) {
    const SourceWarp& warp = warps[std::min(i, warps.size() - 1)];  // those beyond the last are not used
    Warps& four = fours_[i / 4];
    const auto at = static_cast<Eigen::Index>(i % 4);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        four.rotation[row][column][at] = warp.source_from_target().rotation(row, column);
      four.translation[row][at] = warp.source_from_target().translation[row];
      four.centre[row][at] = warp.centre()[row];
    }
    four.age_weight[at] = warp.age_weight();
    angle_scale_ = warp.angle_scale();
  }
}

const std::vector<WarpedPoint>& WarpGroup::project(const Eigen::Vector3f& point) {
  point_ = point;
  const auto coordinate = [&](const Warps& four, int row) -> Four {
    const auto& r = four.rotation[row];
    return r[0] * point.x() + (r[1] * point.y() + r[2] * point.z()) + four.translation[row];
  };
  for (std::size_t i = 0; i < fours_.size(); ++i) {
    x_[i] = coordinate(fours_[i], 0);
    y_[i] = coordinate(fours_[i], 1);
    depth_[i] = coordinate(fours_[i], 2);
  }
  rays_.pixels(4 * fours_.size(), x_.front().data(), y_.front().data(), depth_.front().data());
  for (std::size_t i = 0; i < warped_.size(); ++i) {
    WarpedPoint& warped = warped_[i];
    warped = {{number_of(x_, i), number_of(y_, i)}, number_of(depth_, i)};
    if (!(warped.pixel.x() >= 0.0F)) continue;
    all_[i].look_up(warped);
  }
  return warped_;
}

const std::vector<Four>& WarpGroup::weights_nearby() {
  constexpr float kNearby = 0.01F;  // relative to the depth: half a degree
  const float limit = kNearby * point_.z();
  const bool is_nearby = (point_ - weighted_).squaredNorm() < limit * limit;
  return is_nearby ? weights_ : weights();
}

const std::vector<Four>& WarpGroup::weights() {
  weighted_ = point_;
  const float length = point_.norm();
  for (std::size_t i = 0; i < fours_.size(); ++i) {
    const Warps& four = fours_[i];
    const Four x = point_.x() - four.centre[0], y = point_.y() - four.centre[1],
               z = point_.z() - four.centre[2];
    const Four dot = point_.x() * x + point_.y() * y + point_.z() * z;
    const Four cosine = dot / (length * (x * x + y * y + z * z).sqrt() + 1e-9F);
    const Four sharpness = (point_.z() / depth_[i]).min(1.0F);
    weights_[i] = four.age_weight * (-angle_of(cosine) / angle_scale_).exp() * sharpness * sharpness;
  }
  return weights_;
}

}  // namespace roslam
