// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/depth_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "roslam/common/error.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

using simulation::mix;
using simulation::unit;

// Noise of deviation 1, correlated between neighbouring pixels, as the windows of stereo matching overlap.
cv::Mat correlated_noise(cv::Size size, std::uint32_t seed) {
  cv::Mat noise(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    const auto row_seed = mix(seed, static_cast<std::uint32_t>(y));
    float* row = noise.ptr<float>(y);
    for (int x = 0; x < size.width; ++x)
      row[x] = simulation::normal(mix(row_seed + static_cast<std::uint32_t>(x)));
  }
  // Weights 1 2 1 have the norm sqrt(6) in each direction.
  const cv::Mat weights = (cv::Mat_<float>(1, 3) << 1, 2, 1) / std::sqrt(6.0);
  cv::sepFilter2D(noise, noise, CV_32F, weights, weights, {-1, -1}, 0, cv::BORDER_REFLECT_101);
  return noise;
}

// Marks the pixels occluded for the right imager: a strip to the left of each object.
void mark_shadow(const float* depth, int width, float disparity_of_metre, std::vector<std::uint8_t>& hidden) {
  float leftmost = std::numeric_limits<float>::max();  // in the right image, of all that lies further right
  for (int x = width - 1; x >= 0; --x) {
    const float disparity = depth[x] > 0 ? disparity_of_metre / depth[x] : 0.0F;
    const float seen_at = static_cast<float>(x) - disparity;
    hidden[static_cast<std::size_t>(x)] = seen_at > leftmost + 0.75F ? 1 : 0;
    leftmost = std::min(leftmost, seen_at);
  }
}

// How steeply the surface recedes: depth gained over the width of a pixel there. 1 is a slope of 45 degrees.
float steepness(const cv::Mat& depth, int x, int y, float focal) {
  const auto at = [&](int i, int j) {
    return depth.at<float>(std::clamp(j, 0, depth.rows - 1), std::clamp(i, 0, depth.cols - 1));
  };
  const float z = at(x, y);
  // The smaller of the two sides: an edge of an object is no slope.
  const float across = std::min(std::abs(at(x + 1, y) - z), std::abs(z - at(x - 1, y)));
  const float down = std::min(std::abs(at(x, y + 1) - z), std::abs(z - at(x, y - 1)));
  return std::sqrt(across * across + down * down) * focal / z;
}

}  // namespace

void DepthNoiseOptions::validate() const {
  const auto check = [](const char* field, bool good) {
    if (!good) throw OptionsError(std::string("depth noise: ") + field + " is out of its range");
  };
  check("baseline", baseline > 0);
  check("disparity_sigma", disparity_sigma >= 0);
  check("min_depth", min_depth >= 0);
  check("sure_depth", sure_depth >= min_depth);
  check("max_depth", max_depth > sure_depth);
  check("resolution", resolution > 0);
}

cv::Mat stereo_depth(const cv::Mat& truth, const Camera& camera, const DepthNoiseOptions& options,
                     std::uint32_t seed) {
  options.validate();
  CV_Assert(truth.type() == CV_32FC1);
  const cv::Mat noise = correlated_noise(truth.size(), mix(seed, 1));
  cv::Mat measured(truth.size(), CV_32FC1, cv::Scalar(0));
  const auto disparity_of_metre = static_cast<float>(camera.fx * options.baseline);
  const auto sigma = static_cast<float>(options.disparity_sigma);
  const auto sure = static_cast<float>(options.sure_depth);
  const auto span = static_cast<float>(options.max_depth) - sure;
  const auto steps = static_cast<float>(1.0 / options.resolution);
  std::vector<std::uint8_t> hidden(static_cast<std::size_t>(truth.cols));
  for (int y = 0; y < truth.rows; ++y) {
    const float* depth = truth.ptr<float>(y);
    mark_shadow(depth, truth.cols, disparity_of_metre, hidden);
    for (int x = 0; x < truth.cols; ++x) {
      const float z = depth[x];
      if (z < static_cast<float>(options.min_depth) || z >= sure + span) continue;
      if (hidden[static_cast<std::size_t>(x)] != 0) continue;
      const float lost_far = std::max(0.0F, (z - sure) / span);
      const float lost_slanted =
          std::clamp((steepness(truth, x, y, static_cast<float>(camera.fx)) - 6.0F) / 14.0F, 0.0F, 1.0F);
      const float lost = 1.0F - (1.0F - lost_far) * (1.0F - lost_slanted);
      if (lost > 0.0F) {
        // Correlated over a few pixels, as the holes of stereo matching are.
        const float luck =
            0.7F * simulation::value_noise(static_cast<float>(x) / 5, static_cast<float>(y) / 5, seed) +
            0.3F * unit(mix(seed, static_cast<std::uint32_t>(y * truth.cols + x)));
        if (luck < 0.15F + 0.7F * lost) continue;
      }
      const float disparity = disparity_of_metre / z + sigma * noise.at<float>(y, x);
      if (disparity <= 0.0F) continue;
      measured.at<float>(y, x) = std::round(disparity_of_metre / disparity * steps) / steps;
    }
  }
  return measured;
}

}  // namespace roslam::simulation
