// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "simulation/simulated_options.hpp"

namespace roslam::simulation {

/// Trajectory of the simulated camera: a smooth function of time (continuous up to acceleration),
/// deterministic in the options.
class Flight {
 public:
  explicit Flight(const SimulatorOptions& options);

  double duration() const { return duration_; }  ///< seconds
  SE3 T_world_camera(double time) const;
  SE3 T_body_camera() const;  ///< how the camera is mounted; sway and gusts turn the body

 private:
  struct Waypoint {
    Eigen::Vector2d position;
    double heading;
  };
  void go(double length, double turn);
  Waypoint at(double way) const;

  SimulatorOptions options_;
  double duration_ = 0.0;
  std::vector<Waypoint> track_;  ///< every kStep metres along the path
};

}  // namespace roslam::simulation
