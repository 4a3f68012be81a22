// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/flow_consistency.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr std::size_t kPosePoints = 200;
constexpr std::size_t kCheckedPoints = 200;
constexpr std::size_t kCheckedRemovedPoints = 150;
constexpr int kMinPosePoints = 20;
constexpr double kMinAgreement = 0.5;  // of the points tracked
constexpr double kFar = 1e4;           // metres, for unknown depth: only rotation matters

Eigen::Vector2d vector_of(const cv::Point2f& point) { return {point.x, point.y}; }

}  // namespace

cv::Point2f FlowConsistency::expected(const PastFrame& past, const PastFrame& current,
                                      const cv::Point2f& point) const {
  if (!past.T_camera_world || !current.T_camera_world) return point;
  const float depth = past.depth.empty() ? 0.0F : depth_at(past.depth, point, depth_);
  const Eigen::Vector3d in_past =
      camera_.unproject(camera_.undistort(vector_of(point)), depth > 0.0F ? depth : kFar);
  const Eigen::Vector3d seen = *current.T_camera_world * (past.T_camera_world->inverse() * in_past);
  if (seen.z() < 0.05) return point;
  const Eigen::Vector2d pixel = camera_.distort(camera_.project(seen));
  return {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
}

std::optional<SE3> FlowConsistency::camera_pose(const PastFrame& last, const PastFrame& current,
                                                const SE3& predicted_T_camera_world) const {
  if (!last.T_camera_world) return std::nullopt;
  PastFrame predicted = current;
  predicted.T_camera_world = predicted_T_camera_world;
  const auto points = thinned(last.points, kPosePoints);
  std::vector<cv::Point2f> guess;
  for (const auto& point : points) guess.push_back(expected(last, predicted, point));
  const auto found = track_points(last.pyramid, current.pyramid, points, guess);
  const SE3 T_world_last = last.T_camera_world->inverse();
  std::vector<PoseMeasurement> measurements;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!found[i] || last.depth.empty()) continue;
    const float depth = depth_at(last.depth, points[i], depth_);
    if (depth <= 0.0F) continue;
    PoseMeasurement m;
    m.point_world = T_world_last * camera_.unproject(camera_.undistort(vector_of(points[i])), depth);
    const Eigen::Vector2f pixel = camera_.undistort(vector_of(*found[i])).cast<float>();
    const float now = current.depth.empty() ? 0.0F : depth_at(current.depth, *found[i], depth_);
    m.measurement = Measurement::make(pixel, now, 1.0F, noise_);
    measurements.push_back(m);
  }
  if (static_cast<int>(measurements.size()) < kMinPosePoints) return std::nullopt;
  const OptimisedPose pose = optimise_pose(camera_, measurements, predicted_T_camera_world, pose_);
  if (pose.inliers < kMinPosePoints ||
      pose.inliers < kMinAgreement * static_cast<double>(measurements.size()))
    return std::nullopt;
  return pose.T_camera_world;
}

// Squared Mahalanobis distance of a point from where it would be if static.
double FlowConsistency::residual(const Eigen::Vector2d& from, float depth, const Eigen::Vector2d& to,
                                 const SE3& T_current_past, double pixel_sigma) const {
  if (depth > 0.0F) {
    const double sigma = noise_.sigma_of_depth(depth);
    const Eigen::Vector3d here = T_current_past * camera_.unproject(from, depth);
    const Eigen::Vector3d farther = T_current_past * camera_.unproject(from, depth + sigma);
    if (here.z() < 0.05 || farther.z() < 0.05) return 0.0;
    const Eigen::Vector2d at_rest = camera_.project(here);
    const Eigen::Vector2d by_depth = camera_.project(farther) - at_rest;
    const Eigen::Matrix2d covariance =
        pixel_sigma * pixel_sigma * Eigen::Matrix2d::Identity() + by_depth * by_depth.transpose();
    const Eigen::Vector2d error = to - at_rest;
    return error.dot(covariance.inverse() * error);
  }
  // Without depth, a static point lies on the segment of its epipolar line from least depth to infinity.
  const Eigen::Vector3d far = T_current_past * camera_.unproject(from, kFar);
  const Eigen::Vector3d near = T_current_past * camera_.unproject(from, depth_.min_depth);
  if (far.z() < 0.05 || near.z() < 0.01) return 0.0;
  const Eigen::Vector2d begin = camera_.project(far);
  const Eigen::Vector2d along = camera_.project(near) - begin;
  const double length = along.squaredNorm();
  const double share = length > 0.0 ? std::clamp((to - begin).dot(along) / length, 0.0, 1.0) : 0.0;
  return (to - begin - share * along).squaredNorm() / (pixel_sigma * pixel_sigma);
}

TrackedPoints FlowConsistency::follow(const PastFrame& past, const PastFrame& current) const {
  if (!past.T_camera_world || !current.T_camera_world) return {};
  std::vector<cv::Point2f> points = thinned(past.points, kCheckedPoints);
  const auto removed = thinned(past.moving_points, kCheckedRemovedPoints);
  const std::size_t static_count = points.size();
  points.insert(points.end(), removed.begin(), removed.end());
  std::vector<cv::Point2f> guess;
  for (const auto& point : points) guess.push_back(expected(past, current, point));
  const auto found = track_points(past.pyramid, current.pyramid, points, guess);
  const SE3 T_current_past = *current.T_camera_world * past.T_camera_world->inverse();
  struct Followed {
    cv::Point2f now;
    Eigen::Vector2d from, to;
    float depth;
  };
  std::vector<Followed> followed;
  std::vector<double> errors;  // of points outside the mask of the past frame
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!found[i]) continue;
    const Followed f{*found[i], camera_.undistort(vector_of(points[i])),
                     camera_.undistort(vector_of(*found[i])),
                     past.depth.empty() ? 0.0F : depth_at(past.depth, points[i], depth_)};
    if (i < static_count) errors.push_back(residual(f.from, f.depth, f.to, T_current_past, 1.0));
    followed.push_back(f);
  }
  constexpr std::size_t kMinPoints = 10;
  if (errors.size() < kMinPoints) return {};
  // Most points are static, so the median residual gives the noise of pixels and pose in this frame.
  constexpr double kSigmaOfMedian = 1.1774;  // median of a Rayleigh distribution, in sigmas
  const double sigma = std::max(1.0, std::sqrt(upper_median(errors)) / kSigmaOfMedian);
  const double limit = options_.flow_tolerance * options_.flow_tolerance;
  TrackedPoints result;
  result.sigma = sigma;
  for (const auto& f : followed) {
    const bool moves = residual(f.from, f.depth, f.to, T_current_past, sigma) > limit;
    (moves ? result.moving : result.at_rest).push_back(f.now);
  }
  return result;
}

std::vector<cv::Point2f> FlowConsistency::in_company(const TrackedPoints& followed) const {
  const float radius = static_cast<float>(camera_.width) / 20.0F;
  const auto near = [&](const std::vector<cv::Point2f>& points, const cv::Point2f& centre) {
    return std::count_if(points.begin(), points.end(), [&](const cv::Point2f& p) {
      return std::abs(p.x - centre.x) < radius && std::abs(p.y - centre.y) < radius;
    });
  };
  constexpr std::ptrdiff_t kNeeded = 3;  // itself included
  std::vector<cv::Point2f> result;
  for (const auto& point : followed.moving) {
    const auto moving = near(followed.moving, point);
    if (moving >= kNeeded && moving > near(followed.at_rest, point)) result.push_back(point);
  }
  return result;
}

}  // namespace roslam
