// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/map/map.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"

namespace roslam::scene {

/// A wall of points with distinct descriptors, and a camera that flies along it; the map is built as by
/// odometry with known drift, so that the correct loop closure is known.
class WallFlight {
 public:
  struct Point {
    Eigen::Vector3d position;
    Descriptor descriptor;
  };

  explicit WallFlight(std::uint64_t seed) : random_(seed) {}

  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
  }

  Descriptor descriptor() { return {random_(), random_(), random_(), random_()}; }

  double normal() { return std::normal_distribution<double>()(random_); }

  /// A circular wall 4 m outside a circular path.
  void build_ring(int points = 6000) {
    for (int i = 0; i < points; ++i) {
      const double angle = uniform(0.0, 2.0 * M_PI);
      const double radius = kRadius + 4.0 + uniform(-0.5, 0.5);
      points_.push_back(
          {{radius * std::cos(angle), radius * std::sin(angle), uniform(-2.0, 2.0)}, descriptor()});
    }
  }

  /// A straight wall 4 m beside a straight path, whose points repeat with that period (metres).
  void build_wall(double length, double period) {
    std::vector<Point> pattern;
    for (int i = 0; i < static_cast<int>(50.0 * period); ++i)
      pattern.push_back({{uniform(0.0, period), 4.0 + uniform(-0.5, 0.5), uniform(-2.0, 2.0)}, descriptor()});
    for (double start = -period; start < length + period; start += period) {
      for (Point point : pattern) {
        point.position.x() += start;
        points_.push_back(point);
      }
    }
  }

  /// T_camera_world of a camera at that position with that heading (radians from x, horizontal).
  static SE3 looking(const Eigen::Vector3d& position, double heading) {
    const Eigen::Vector3d ahead(std::cos(heading), std::sin(heading), 0.0);
    Eigen::Matrix3d R_world_camera;
    R_world_camera << Eigen::Vector3d(ahead.y(), -ahead.x(), 0.0), -Eigen::Vector3d::UnitZ(), ahead;
    return SE3(R_world_camera, position).inverse();
  }

  /// T_camera_world on the circular path at that angle (radians).
  static SE3 on_ring(double angle) {
    return looking({kRadius * std::cos(angle), kRadius * std::sin(angle), 0.0}, angle);
  }

  /// T_camera_world on the straight path.
  static SE3 on_wall(double x) { return looking({x, 0.0, 0.0}, M_PI / 2); }

  /// The features seen from that pose. ids: receives the index of the point of each.
  std::shared_ptr<ObservedFrame> view(const SE3& T_camera_world, std::vector<std::size_t>* ids = nullptr) {
    auto frame = std::make_shared<ObservedFrame>();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d in_camera = T_camera_world * points_[i].position;
      if (in_camera.z() < 0.5 || in_camera.z() > 8.0) continue;
      const Eigen::Vector2d pixel = camera_.project(in_camera) + 0.5 * Eigen::Vector2d(normal(), normal());
      if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > camera_.width - 1 ||
          pixel.y() > camera_.height - 1)
        continue;
      frame->pixels.push_back(pixel.cast<float>());
      const double sigma = noise_.sigma_of_depth(in_camera.z());
      frame->depths.push_back(static_cast<float>(in_camera.z() + 0.3 * sigma * normal()));
      frame->levels.push_back(1);
      frame->angles.push_back(0.0F);
      frame->colours.emplace_back(128, 128, 128);
      Descriptor seen = points_[i].descriptor;
      for (int k = 0; k < 8; ++k) seen[random_() % 4] ^= std::uint64_t{1} << (random_() % 64);
      frame->descriptors.push_back(seen);
      if (ids != nullptr) ids->push_back(i);
    }
    frame->grid = FeatureGrid(
        frame->pixels, {0.0, 0.0, static_cast<double>(camera_.width), static_cast<double>(camera_.height)});
    return frame;
  }

  /// Adds the keyframe of that true pose to the map, at the pose of an odometry with a relative error of
  /// `drift` a step. A point seen in the last few keyframes keeps its landmark, others get a new one.
  KeyframeId fly_to(const SE3& T_camera_world, double drift, Map& map) {
    Vector6d error = Vector6d::Zero();
    if (!true_poses_.empty()) {
      for (int k = 0; k < 6; ++k) error(k) = drift * (k < 3 ? 1.0 : 0.1) * (1.0 + 0.3 * normal());
      error(2) = error(4) = 0.0;
    }
    const SE3 last = true_poses_.empty() ? T_camera_world : map.T_camera_world(KeyframeId{last_});
    const SE3 step = true_poses_.empty() ? SE3() : T_camera_world * true_poses_.back().inverse();
    std::vector<std::size_t> ids;
    const auto seen = view(T_camera_world, &ids);
    const KeyframeId keyframe =
        map.add_keyframe(true_poses_.size(), 0.1 * static_cast<double>(true_poses_.size()),
                         SE3::exp(error) * step * last, seen);
    last_ = keyframe.value;
    true_poses_.push_back(T_camera_world);
    for (std::uint32_t i = 0; i < ids.size(); ++i) show(ids[i], keyframe, i, map);
    return keyframe;
  }

  /// Position error of a keyframe in the map, metres.
  double error_of(const Map& map, KeyframeId id) const {
    return (map.T_camera_world(id).inverse().translation() - true_poses_[id.index()].inverse().translation())
        .norm();
  }

  double mean_error(const Map& map) const {
    double sum = 0.0;
    for (const KeyframeId id : map.keyframe_ids()) sum += error_of(map, id);
    return sum / static_cast<double>(map.keyframe_count());
  }

  const Camera& camera() const { return camera_; }
  std::size_t flown() const { return true_poses_.size(); }

  static constexpr double kRadius = 12.0;  // metres, of the circular path

 private:
  void show(std::size_t point, KeyframeId keyframe, std::uint32_t index, Map& map) {
    constexpr std::uint32_t kMoment = 4;  // keyframes
    const auto known = known_.find(point);
    if (known != known_.end() && keyframe.value - known->second.second <= kMoment) {
      const LandmarkId landmark = map.resolve(known->second.first);
      if (map.find(landmark) != nullptr && map.add_observation(landmark, keyframe, index))
        map.refresh(landmark);
      known->second.second = keyframe.value;
      return;
    }
    const Keyframe& frame = *map.find(keyframe);
    const Eigen::Vector3d in_camera = camera_.unproject(frame.view->pixels[index].cast<double>(),
                                                        static_cast<double>(frame.view->depths[index]));
    known_[point] = {map.add_landmark(frame.T_camera_world.inverse() * in_camera, keyframe, index),
                     keyframe.value};
  }

  std::mt19937_64 random_;
  Camera camera_;
  MeasurementNoise noise_;
  std::vector<Point> points_;
  std::vector<SE3> true_poses_;                                        // T_camera_world, by keyframe
  std::map<std::size_t, std::pair<LandmarkId, std::uint32_t>> known_;  // by point; keyframe last seen
  std::uint32_t last_ = 0;
};

}  // namespace roslam::scene
