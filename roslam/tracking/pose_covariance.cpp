// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/pose_covariance.hpp"

#include <map>

namespace roslam {

namespace {
// Maps a perturbation of one frame's pose to that of another that moves with it.
Matrix6d adjoint(const SE3& T_b_a) {
  const Eigen::Matrix3d R = T_b_a.rotation().toRotationMatrix();
  Matrix6d result = Matrix6d::Zero();
  result.topLeftCorner<3, 3>() = R;
  result.bottomRightCorner<3, 3>() = R;
  result.topRightCorner<3, 3>() = skew(T_b_a.translation()) * R;
  return result;
}
}  // namespace

Matrix6d covariance_in_world(const SE3& T_world_camera, const Matrix6d& by_camera) {
  const Eigen::Matrix3d R = T_world_camera.rotation().toRotationMatrix();
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = R;
  turn.bottomRightCorner<3, 3>() = R;
  return turn * by_camera * turn.transpose();
}

Matrix6d carried(const Matrix6d& covariance_of_a, const SE3& T_b_a) {
  const Matrix6d moves = adjoint(T_b_a);
  return moves * covariance_of_a * moves.transpose();
}

Matrix6d PoseCovariance::of_prediction(const Matrix6d& last, const SE3& T_camera_last, double seconds) {
  // What the motion model does not know, as standard deviations.
  constexpr double kSpeed = 0.2;         // m/s
  constexpr double kAcceleration = 2.0;  // m/s^2
  constexpr double kTurnRate = 0.3;      // radians/s
  const double position = kSpeed * seconds + 0.5 * kAcceleration * seconds * seconds;
  const double rotation = kTurnRate * seconds;
  Matrix6d covariance = carried(last, T_camera_last);
  covariance.diagonal().head<3>().array() += position * position;
  covariance.diagonal().tail<3>().array() += rotation * rotation;
  return covariance;
}

// The features of an image share a part of their errors: depth is wrong in patches, and blur and the raster
// of the pyramid move whole regions. On simulated flights they inform as a fifth as many independent ones.
Matrix6d PoseCovariance::of_measurement(const Matrix6d& by_measurement) {
  constexpr double kShared = 5.0;
  return kShared * by_measurement;
}

Matrix6d PoseCovariance::of_frame(const Map& map, const SE3& T_camera_world,
                                  std::span<const LandmarkId> landmarks,
                                  const Matrix6d& by_measurement) const {
  std::map<KeyframeId, int> created;  // landmarks by the keyframe that created them
  int count = 0;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    ++created[landmark->created_by];
    ++count;
  }
  Matrix6d covariance = of_measurement(by_measurement);
  for (const auto& [keyframe, landmarks_of_it] : created) {
    if (keyframe.index() >= keyframes_.size()) continue;
    const SE3 T_camera_keyframe = T_camera_world * map.T_camera_world(keyframe).inverse();
    covariance += landmarks_of_it / static_cast<double>(count) *
                  carried(keyframes_[keyframe.index()], T_camera_keyframe);
  }
  return covariance;
}

void PoseCovariance::add_keyframe(KeyframeId keyframe, const Matrix6d& covariance) {
  if (keyframe.index() >= keyframes_.size()) keyframes_.resize(keyframe.index() + 1, Matrix6d::Zero());
  keyframes_[keyframe.index()] = covariance;
}

}  // namespace roslam
