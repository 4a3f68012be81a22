// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/flow_consistency.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr int kMinPosePoints = 20;
constexpr double kMinAgreement = 0.5;  // of the points tracked
constexpr double kFar = 1e4;           // metres, for unknown depth: only rotation matters

// Limit of the forward-backward error, the larger of the two.
constexpr float kMaxReturn = 1.0F;       // pixels
constexpr float kMaxReturnShare = 0.1F;  // of the motion against the static scene
}  // namespace

cv::Point2f FlowConsistency::expected(const PastFrame& past, const PastFrame& current,
                                      const cv::Point2f& point) const {
  return expected(past, current, point, camera_.undistort({point.x, point.y}));
}

cv::Point2f FlowConsistency::expected(const PastFrame& past, const PastFrame& current,
                                      const cv::Point2f& point, const Eigen::Vector2d& undistorted) const {
  if (!past.T_camera_world || !current.T_camera_world) return point;
  const float depth = past.depth.empty() ? 0.0F : depth_at(past.depth, point, depth_);
  const Eigen::Vector3d in_past = camera_.unproject(undistorted, depth > 0.0F ? depth : kFar);
  const Eigen::Vector3d seen = *current.T_camera_world * (past.T_camera_world->inverse() * in_past);
  if (seen.z() < 0.05) return point;
  const Eigen::Vector2d pixel = camera_.distort(camera_.project(seen));
  return {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
}

std::optional<SE3> FlowConsistency::track(const PastFrame& last, PastFrame& current) const {
  std::vector<cv::Point2f> points;
  std::vector<cv::Point2f> guess;
  for (const Corner& corner : last.corners) {
    points.push_back(corner.pixel);
    guess.push_back(expected(last, current, corner.pixel, corner.undistorted));
  }
  const auto found = track_points(last.pyramid, current.pyramid, points, guess);
  current.corners.clear();
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i]) continue;
    const Corner& corner = last.corners[i];
    current.corners.push_back(
        {corner.track, *found[i], camera_.undistort({found[i]->x, found[i]->y}), corner.is_removed});
  }
  const auto pose = camera_pose(last, current);
  if (pose) current.T_camera_world = pose;
  return pose;
}

std::optional<SE3> FlowConsistency::camera_pose(const PastFrame& last, const PastFrame& current) const {
  if (!last.T_camera_world || !current.T_camera_world || last.depth.empty()) return std::nullopt;
  const SE3 T_world_last = last.T_camera_world->inverse();
  struct Usable {
    CornerMatch match;
    float depth;  // in the last frame
  };
  std::vector<Usable> usable;
  for (const auto& match : common_corners(last, current)) {
    if (match.from->is_removed) continue;
    const float depth = depth_at(last.depth, match.from->pixel, depth_);
    if (depth > 0.0F) usable.push_back({match, depth});
  }
  std::vector<PoseMeasurement> measurements;
  constexpr std::size_t kEnough = 200;
  const std::size_t count = std::min(usable.size(), kEnough);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [match, depth] = usable[i * usable.size() / count];
    const auto& [from, to] = match;
    const float now = current.depth.empty() ? 0.0F : depth_at(current.depth, to->pixel, depth_);
    PoseMeasurement m;
    m.point_world = T_world_last * camera_.unproject(from->undistorted, depth);
    m.measurement =
        Measurement::make(to->undistorted.cast<float>(), now, 1.0F, noise_);
    measurements.push_back(m);
  }
  if (static_cast<int>(measurements.size()) < kMinPosePoints) return std::nullopt;
  const OptimisedPose pose = optimise_pose(camera_, measurements, *current.T_camera_world, pose_);
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

// Whether a nearer surface is now where the corner would be if static, so that its track is wrong.
bool FlowConsistency::is_covered(const Corner& from, float depth, const Corner& to,
                                 const cv::Mat& depth_image, const SE3& T_current_past) const {
  if (depth <= 0.0F || depth_image.empty()) return false;
  const double now = depth_at(depth_image, to.pixel, depth_);
  const double z = (T_current_past * camera_.unproject(from.undistorted, depth)).z();
  const double sigma = std::hypot(noise_.sigma_of_depth(depth), noise_.sigma_of_depth(now));
  return now > 0.0 && now < z - 3.0 * sigma - options_.depth_tolerance * z;
}

TrackedPoints FlowConsistency::follow(const PastFrame& past, PastFrame& current) const {
  if (!past.T_camera_world || !current.T_camera_world) return {};
  const auto matches = common_corners(past, current);
  const SE3 T_current_past = *current.T_camera_world * past.T_camera_world->inverse();
  std::vector<float> depths;
  std::vector<double> errors;  // of corners outside the mask of the past frame
  for (const auto& [from, to] : matches) {
    depths.push_back(past.depth.empty() ? 0.0F : depth_at(past.depth, from->pixel, depth_));
    if (!from->is_removed)
      errors.push_back(residual(from->undistorted, depths.back(), to->undistorted, T_current_past, 1.0));
  }
  constexpr std::size_t kMinPoints = 10;
  if (errors.size() < kMinPoints) return {};
  // Most points are static, so the median residual gives the noise of pixels and pose in this frame.
  constexpr double kSigmaOfMedian = 1.1774;  // median of a Rayleigh distribution, in sigmas
  TrackedPoints result;
  result.sigma = std::max(1.0, std::sqrt(upper_median(errors)) / kSigmaOfMedian);
  const double limit = options_.flow_tolerance * options_.flow_tolerance;
  std::vector<CornerMatch> moving;
  std::vector<int> lost;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto& [from, to] = matches[i];
    if (residual(from->undistorted, depths[i], to->undistorted, T_current_past, result.sigma) > limit) {
      moving.push_back(matches[i]);
    } else if (is_covered(*from, depths[i], *to, current.depth, T_current_past)) {
      lost.push_back(to->track);
    } else {
      result.at_rest.push_back(to->pixel);
    }
  }
  // Only corners that were tracked correctly move with the static scene, so that the others alone are
  // checked. The longer the motion, the less it matters how precisely it was tracked.
  const auto errors_back = return_errors(past.pyramid, current.pyramid, moving);
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const auto& [from, to] = moving[i];
    const cv::Point2f motion = to->pixel - expected(past, current, from->pixel, from->undistorted);
    if (errors_back[i] <= std::max(kMaxReturn, kMaxReturnShare * std::hypot(motion.x, motion.y)))
      result.moving.push_back(to->pixel);
    else
      lost.push_back(to->track);
  }
  std::sort(lost.begin(), lost.end());
  std::erase_if(current.corners, [&](const Corner& corner) {
    return std::binary_search(lost.begin(), lost.end(), corner.track);
  });
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
