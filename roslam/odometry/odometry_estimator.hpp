// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>

#include "roslam/geometry/se3.hpp"
#include "roslam/odometry/motion_filter.hpp"
#include "roslam/odometry/odometry.hpp"
#include "roslam/tracking/tracked_frame.hpp"

namespace roslam {

/// Joins the motions from frame to frame, each taken between two poses in one state of the map, to a pose
/// that no correction of the map moves, and filters it. Not thread safe.
class OdometryEstimator {
 public:
  explicit OdometryEstimator(const SE3& T_body_camera) : T_body_camera_(T_body_camera) {}

  /// What became of the next frame. submap: that it was tracked in. Nothing if it has no pose.
  std::optional<Odometry> add(const TrackedFrame& frame, SubmapId submap);

  /// To be called when the world frame of the submap was turned or moved: that is no error of odom.
  void world_changed(const SE3& T_new_old) { T_map_odom_at_start_ = T_new_old * T_map_odom_at_start_; }

  /// To be called when the source's clock was reset to that time (seconds), as Tracker::restart_clock.
  void restart_clock(double timestamp);

 private:
  struct Placed {  // a tracked frame
    double timestamp;
    SE3 T_odom_camera;
  };

  void place(const TrackedFrame& frame, SubmapId submap);
  SE3 beside_last(const TrackedFrame& frame) const;
  void filter(const TrackedFrame& frame);
  Odometry output(const TrackedFrame& frame, bool is_predicted);

  SE3 T_body_camera_;
  MotionFilter filter_;
  std::deque<Placed> placed_;  // of the last seconds, oldest first
  SE3 T_map_odom_;
  SE3 T_map_odom_at_start_;  // as it was at the last reset, or when the submap became another one
  SubmapId submap_;
  Matrix6d drift_ = Matrix6d::Zero();  // covariance of what all poses at this time have in common, in odom
  std::size_t resets_ = 0;
  bool is_interrupted_ = false;  // since the last pose
  bool starts_ = true;           // the filter has to begin anew
};

}  // namespace roslam
