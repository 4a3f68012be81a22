// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/map_truth.hpp"

#include <cmath>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
// Key of the voxel; voxels of 2 cm have unique keys over 40 km.
std::uint64_t voxel_key(const Eigen::Vector3d& position, double side) {
  constexpr std::int64_t kMask = (std::int64_t{1} << 21) - 1;
  const auto along = [&](double value) {
    return static_cast<std::int64_t>(std::floor(value / side)) & kMask;
  };
  return static_cast<std::uint64_t>(along(position.x()) << 42 | along(position.y()) << 21 |
                                    along(position.z()));
}

void require_positive(double value, const char* name) {
  if (!(value > 0.0 && std::isfinite(value)))
    throw OptionsError(std::string(name) + " must be a positive number of metres");
}

bool is_set(const cv::Mat& mask, int y, int x) { return !mask.empty() && mask.at<std::uint8_t>(y, x) != 0; }
}  // namespace

void MapTruthOptions::validate() const {
  require_positive(range, "range");
  require_positive(far_range, "far_range");
  require_positive(spacing, "spacing");
  require_positive(moving_range, "moving_range");
  require_positive(moving_spacing, "moving_spacing");
  require_positive(moving_gap, "moving_gap");
  if (far_range < range) throw OptionsError("far_range must not be below range");
  if (stride < 1) throw OptionsError("stride must be 1 pixel or more");
}

MapTruth::MapTruth(const Camera& camera, const MapTruthOptions& options)
    : camera_(camera), options_(options) {
  camera.validate();
  options.validate();
  for (int y = 0; y < camera.height; y += options.stride) {
    for (int x = 0; x < camera.width; x += options.stride) {
      const Eigen::Vector2d pixel(x, y);
      rays_.push_back(camera.unproject(camera.has_distortion() ? camera.undistort(pixel) : pixel, 1.0));
    }
  }
}

MapTruth::MapTruth(const SurfaceMap& surface, const MapTruthOptions& options) : options_(options) {
  options.validate();
  for (const SurfacePoint& point : surface.points)
    add_static(point.position.cast<double>(), 0.0F, point.colour);
}

void MapTruth::check(const MapTruthFrame& frame) const {
  const auto require = [&](const cv::Mat& image, int type, const char* name) {
    if (image.type() == type && image.size() == cv::Size(camera_.width, camera_.height)) return;
    throw InputError(std::string("the ") + name + " is " + std::to_string(image.cols) + "x" +
                     std::to_string(image.rows) + " but the camera's images are " +
                     std::to_string(camera_.width) + "x" + std::to_string(camera_.height) +
                     " pixels, or it is of another type; check the camera");
  };
  require(frame.background_depth, CV_32FC1, "depth of the background");
  if (!frame.background_colour.empty()) require(frame.background_colour, CV_8UC3, "colour of the background");
  if (!frame.taken_depth.empty()) require(frame.taken_depth, CV_32FC1, "depth with movable objects");
  if (!frame.moving) return;
  if (!frame.moving->actors.empty()) require(frame.moving->actors, CV_8UC1, "mask of moving objects");
  if (!frame.moving->at_rest.empty()) require(frame.moving->at_rest, CV_8UC1, "mask of objects at rest");
}

void MapTruth::add(const MapTruthFrame& frame) {
  check(frame);
  const auto gap = static_cast<float>(options_.moving_gap);
  std::size_t ray = 0;
  for (int y = 0; y < camera_.height; y += options_.stride) {
    for (int x = 0; x < camera_.width; x += options_.stride) {
      const Eigen::Vector3d& at_one = rays_[ray++];
      const float behind = frame.background_depth.at<float>(y, x);
      if (behind > 0.0F && behind < static_cast<float>(options_.far_range)) {
        std::optional<cv::Vec3b> colour;
        if (!frame.background_colour.empty()) colour = frame.background_colour.at<cv::Vec3b>(y, x);
        add_static(frame.T_world_camera * (at_one * static_cast<double>(behind)), behind, colour);
      }
      const float taken = frame.taken_depth.empty() ? 0.0F : frame.taken_depth.at<float>(y, x);
      if (!(taken > 0.0F) || taken >= static_cast<float>(options_.moving_range)) continue;
      if (behind > 0.0F && behind - taken <= gap) continue;
      if (!frame.moving && !(behind > 0.0F)) continue;  // background not known, rather than empty
      const bool rests = frame.moving && is_set(frame.moving->at_rest, y, x);
      // Depth noise alone can bring a distant wall nearer by more than the gap.
      if (frame.moving && !rests && !is_set(frame.moving->actors, y, x)) continue;
      const Eigen::Vector3d position = frame.T_world_camera * (at_one * static_cast<double>(taken));
      if (moving_at_.try_emplace(voxel_key(position, options_.moving_spacing), moving_.size()).second)
        moving_.push_back({position.cast<float>(), rests});
    }
  }
}

void MapTruth::add_static(const Eigen::Vector3d& position, float depth,
                          const std::optional<cv::Vec3b>& colour) {
  const auto [found, is_new] = static_at_.try_emplace(voxel_key(position, options_.spacing), static_.size());
  if (is_new) static_.emplace_back();
  StaticPoint& point = static_[found->second];
  if (is_new || depth < point.depth) point = {position.cast<float>(), colour, depth};
}

}  // namespace roslam::evaluation
