// SPDX-License-Identifier: BSD-3-Clause
#include "recording/frame_poses.hpp"

#include <map>

namespace roslam::recording {

std::vector<FramePoses> poses_of_frames(const RunContents& run) {
  std::map<std::int64_t, FramePoses> frames;  // by stamp
  for (const StampedPose& pose : run.trajectory)
    frames[ros_stamp(pose.timestamp)].T_map_camera = pose.T_world_camera;
  for (std::size_t i = 0; i < run.odometry.size(); ++i)
    frames[ros_stamp(run.odometry[i].timestamp)].odometry = i;
  const SE3 T_camera_body = run.source.camera.T_body_camera.inverse();
  SE3 T_map_odom;
  std::vector<FramePoses> result;
  result.reserve(frames.size());
  for (auto& [stamp, frame] : frames) {
    frame.stamp = stamp;
    if (frame.odometry) frame.T_odom_body = run.odometry[*frame.odometry].T_odom_body;
    if (frame.T_map_camera) {
      const SE3 T_map_body = *frame.T_map_camera * T_camera_body;
      if (frame.odometry) {
        T_map_odom = T_map_body * frame.T_odom_body.inverse();
      } else {
        frame.T_odom_body = T_map_odom.inverse() * T_map_body;
      }
      frame.T_map_odom = T_map_odom;
    }
    result.push_back(frame);
  }
  return result;
}

}  // namespace roslam::recording
