// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/composed_walk.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "roslam/common/error.hpp"

namespace roslam::simulation {
namespace {

constexpr double kGazeWindow = 3.0;    // seconds before and after that the gaze is averaged over
constexpr double kLevelEnough = 0.15;  // length of the level part of a gaze that still tells its direction
constexpr double kLongestWalk = 4 * 3600;  // seconds; after that people stand, which bounds time and memory
constexpr double kFirstGuess = 2.0;        // seconds that a walk is assumed to take before its goal is known
constexpr double kPauseChance = 1.0 / 3.0;
constexpr double kShortestPause = 0.5;  // seconds
constexpr double kLongestPause = 2.0;
constexpr double kShortestWay = 0.05;  // metres; nearer goals are a pause
constexpr int kTries = 10;             // to find a goal whose way does not lead through the camera
constexpr double kStepRate = 1.8;      // steps a second
constexpr double kStepLift = 0.02;     // metres

Eigen::Vector3d along_floor(const Eigen::Vector3d& v, const Eigen::Vector3d& up) {
  return v - up * up.dot(v);
}

double distance_to_way(const Eigen::Vector3d& point, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  const double share = std::clamp(way.dot(point - from) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
  return (from + share * way - point).norm();
}

Eigen::Vector3d up_of(const Trajectory& poses, const ComposerOptions& options) {
  if (options.up) return options.up->normalized();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& pose : poses) sum -= pose.T_world_camera.rotation() * Eigen::Vector3d::UnitY();
  if (sum.norm() < 0.1 * static_cast<double>(poses.size())) {
    throw OptionsError(
        "composer: the orientations of the camera do not determine which way is up; give up, such as 0 0 1");
  }
  return sum.normalized();
}

}  // namespace

WalkingGround::WalkingGround(const Trajectory& poses, const ComposerOptions& options)
    : poses_(poses), up_(up_of(poses, options)) {
  double height = 0.0;
  for (const auto& pose : poses_) height += up_.dot(pose.T_world_camera.translation());
  floor_ = height / static_cast<double>(poses_.size()) - options.camera_height;
}

WalkingGround::Gaze WalkingGround::gaze(double time) const {
  const auto before = [](const StampedPose& pose, double t) { return pose.timestamp < t; };
  auto first = std::lower_bound(poses_.begin(), poses_.end(), time - kGazeWindow, before);
  auto last = std::lower_bound(first, poses_.end(), time + kGazeWindow, before);
  if (first == last) {  // a gap in the truth, or a time outside it
    if (first == poses_.end()) --first;
    last = std::next(first);
  }
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
  for (auto pose = first; pose != last; ++pose) {
    position += pose->T_world_camera.translation();
    ahead += pose->T_world_camera.rotation() * Eigen::Vector3d::UnitZ();
    upper -= pose->T_world_camera.rotation() * Eigen::Vector3d::UnitY();
  }
  const auto count = static_cast<double>(std::distance(first, last));
  position /= count;
  Eigen::Vector3d forward = along_floor(ahead, up_);
  // For a camera that looks straight down, the direction of the upper edge of its image.
  if (forward.norm() < kLevelEnough * count) forward = along_floor(upper, up_);
  if (forward.norm() < kLevelEnough * count) forward = up_.unitOrthogonal();
  forward.normalize();
  return {along_floor(position, up_) + up_ * floor_, forward, forward.cross(up_)};
}

Walk::Walk(const WalkingGround& ground, const ComposerOptions& options, RandomStream& random)
    : up_(ground.up()) {
  const auto place = [&](const WalkingGround::Gaze& gaze, double ahead, double aside) {
    return Eigen::Vector3d(gaze.foot + gaze.forward * ahead + gaze.right * aside);
  };
  const double speed = random.uniform(options.min_speed, options.max_speed);
  const double end = std::min(ground.end(), ground.start() + kLongestWalk);
  double time = ground.start();
  const double first_ahead = random.uniform(options.min_distance, options.max_distance);
  const double first_aside = random.uniform(-options.span, options.span);
  Eigen::Vector3d at = place(ground.gaze(time), first_ahead, first_aside);
  do {
    Eigen::Vector3d goal = at;
    for (int i = 0; i < kTries; ++i) {
      const double ahead = random.uniform(options.min_distance, options.max_distance);
      const double aside = random.uniform(-options.span, options.span);
      const auto guess = place(ground.gaze(time + kFirstGuess), ahead, aside);
      const auto gaze = ground.gaze(time + (guess - at).norm() / speed);
      goal = place(gaze, ahead, aside);
      if (distance_to_way(gaze.foot, at, goal) > 0.7 * options.min_distance) break;
    }
    const double way = (goal - at).norm();
    if (way > kShortestWay) {
      legs_.push_back({time, time + way / speed, at, goal});
      time = legs_.back().end;
      at = goal;
    }
    if (way <= kShortestWay || random.chance(kPauseChance)) {
      legs_.push_back({time, time + random.uniform(kShortestPause, kLongestPause), at, at});
      time = legs_.back().end;
    }
  } while (time <= end);
}

const Walk::Leg& Walk::leg_at(double time) const {
  const auto next = std::upper_bound(legs_.begin(), legs_.end(), time,
                                     [](double t, const Leg& leg) { return t < leg.start; });
  return next == legs_.begin() ? legs_.front() : *std::prev(next);
}

bool Walk::is_walking(double time) const {
  const Leg& leg = leg_at(time);
  return leg.from != leg.to && time >= leg.start && time <= leg.end;
}

Eigen::Vector3d Walk::feet(double time) const {
  const Leg& leg = leg_at(time);
  const double share = std::clamp((time - leg.start) / (leg.end - leg.start), 0.0, 1.0);
  const Eigen::Vector3d on_floor = leg.from + share * (leg.to - leg.from);
  if (leg.from == leg.to) return on_floor;
  // A whole number of steps, so that every walk begins and ends with the feet on the floor.
  const double steps = std::max(1.0, std::round(kStepRate * (leg.end - leg.start)));
  const double phase = share * steps - std::floor(share * steps);
  return on_floor + up_ * (kStepLift * 4.0 * phase * (1.0 - phase));
}

}  // namespace roslam::simulation
