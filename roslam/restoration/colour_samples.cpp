// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/colour_samples.hpp"

#include <algorithm>

namespace roslam {

bool ColourSamples::all_agree() const {
  cv::Vec3f least = samples_.front().colour, most = least;
  for (const ColourSample& sample : samples_) {
    for (int c = 0; c < 3; ++c) {
      least[c] = std::min(least[c], sample.colour[c]);
      most[c] = std::max(most[c], sample.colour[c]);
    }
  }
  return difference(least, most) <= tolerance_;
}

const ColourSample& ColourSamples::consensus() {
  for (auto* channel : {&blue_, &green_, &red_, &cost_})
    channel->assign(fours_for(samples_.size()), Four::Zero());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    number_of(blue_, i) = samples_[i].colour[0];
    number_of(green_, i) = samples_[i].colour[1];
    number_of(red_, i) = samples_[i].colour[2];
  }
  const ColourSample& weighted = medoid(true);
  const auto agreeing = std::count_if(samples_.begin(), samples_.end(), [&](const ColourSample& other) {
    return difference(weighted.colour, other.colour) <= 2.0F * tolerance_;
  });
  if (2 * agreeing >= static_cast<std::ptrdiff_t>(samples_.size())) return weighted;
  return medoid(false);
}

// The sample with the smallest sum of differences from all samples.
const ColourSample& ColourSamples::medoid(bool is_weighted) {
  for (std::size_t i = 0; i < cost_.size(); ++i) {
    cost_[i].setZero();
    for (const ColourSample& other : samples_) {
      const Four difference = ((blue_[i] - other.colour[0]).abs() + (green_[i] - other.colour[1]).abs() +
                               (red_[i] - other.colour[2]).abs()) /
                              3.0F;
      cost_[i] += (is_weighted ? other.weight : 1.0F) * difference.min(2.0F * tolerance_);
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < samples_.size(); ++i)
    if (number_of(cost_, i) < number_of(cost_, best)) best = i;
  return samples_[best];
}

}  // namespace roslam
