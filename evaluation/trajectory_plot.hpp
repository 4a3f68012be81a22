// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "evaluation/trajectory_error.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::evaluation {

/// Up direction of a trajectory's world frame, which determines the view from above.
enum class WorldUp {
  kUnknown,  ///< the plane of the two axes along which the trajectory extends most
  kZ,        ///< from above is x and y, the height is z
  kMinusY,   ///< the world frame is the first camera's: from above is x and z, the height is -y
};

struct NamedTrajectoryError {
  std::string name;
  TrajectoryError error;
};

/// One figure: on the left the paths from above, the truth dashed and grey; on the right the error over time.
/// One estimate is coloured by its error and has lines at RMSE, mean and median; several have a colour each.
cv::Mat plot_trajectory_errors(const Trajectory& truth, const std::vector<NamedTrajectoryError>& estimates,
                               WorldUp up = WorldUp::kUnknown);

/// One trajectory without a truth: on the left its path from above coloured by time, on the right its height
/// (or the third axis) over time.
cv::Mat plot_trajectory(const Trajectory& trajectory, const std::string& name,
                        WorldUp up = WorldUp::kUnknown);

/// Writes a PNG file. Throws OutputError if the name does not end in .png or the file cannot be written in
/// full.
void write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace roslam::evaluation
