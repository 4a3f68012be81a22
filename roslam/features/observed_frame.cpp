// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/observed_frame.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/error.hpp"

namespace roslam {

float depth_at(const cv::Mat& depth, const cv::Point2f& pixel, const DepthOptions& options) {
  const auto x = static_cast<int>(std::lround(pixel.x));
  const auto y = static_cast<int>(std::lround(pixel.y));
  if (x < 0 || y < 0 || x >= depth.cols || y >= depth.rows) return 0.0F;
  const auto least = static_cast<float>(options.min_depth);
  const auto most = static_cast<float>(options.max_depth);
  const auto is_known = [=](float z) { return z >= least && z <= most; };
  const float centre = depth.ptr<float>(y)[x];
  if (!is_known(centre)) return 0.0F;
  const auto tolerance = static_cast<float>(options.edge_ratio + options.edge_growth * centre) * centre;
  const auto differs = [&](int ny, int nx) {
    const float z = depth.ptr<float>(ny)[nx];
    return is_known(z) && std::abs(z - centre) > tolerance;
  };
  const int left = std::max(0, x - 1);
  const int right = std::min(depth.cols - 1, x + 1);
  for (const int ny : {std::max(0, y - 1), y, std::min(depth.rows - 1, y + 1)}) {
    if (differs(ny, left) || differs(ny, x) || differs(ny, right)) return 0.0F;
  }
  return centre;
}

void DepthOptions::validate() const {
  if (!(min_depth > 0.0)) throw OptionsError("depth.min_depth must be positive (metres)");
  if (!(max_depth > min_depth && std::isfinite(max_depth))) {
    throw OptionsError("depth.max_depth must be above min_depth (metres)");
  }
  if (!(edge_ratio > 0.0 && edge_ratio <= 1.0))
    throw OptionsError("depth.edge_ratio must be above 0 and at most 1");
  if (!(edge_growth >= 0.0 && edge_growth <= 1.0))
    throw OptionsError("depth.edge_growth must be 0 to 1 (1/metre)");
}

ObservedFrame observe(std::span<const OrbFeature> features, const cv::Mat& colour, const cv::Mat& depth,
                      const Camera& camera, const DepthOptions& options) {
  ObservedFrame frame;
  const std::size_t count = features.size();
  frame.pixels.reserve(count);
  frame.depths.reserve(count);
  frame.levels.reserve(count);
  frame.angles.reserve(count);
  frame.colours.reserve(count);
  frame.descriptors.reserve(count);
  for (const auto& feature : features) {
    const Eigen::Vector2d pixel(feature.pixel.x, feature.pixel.y);
    frame.pixels.push_back(camera.undistort(pixel).cast<float>());
    frame.depths.push_back(depth.empty() ? 0.0F : depth_at(depth, feature.pixel, options));
    frame.levels.push_back(static_cast<std::uint8_t>(feature.level));
    frame.angles.push_back(feature.angle);
    const cv::Point nearest(std::min(cvRound(feature.pixel.x), colour.cols - 1),
                            std::min(cvRound(feature.pixel.y), colour.rows - 1));
    frame.colours.push_back(colour.empty() ? cv::Vec3b(128, 128, 128) : colour.at<cv::Vec3b>(nearest));
    frame.descriptors.push_back(feature.descriptor);
  }
  frame.grid = FeatureGrid(frame.pixels, camera.undistorted_bounds());
  return frame;
}

}  // namespace roslam
