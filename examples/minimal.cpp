// SPDX-License-Identifier: BSD-3-Clause
// The pipeline of `roslam run` on a recording: frames in, poses out. Writes the same trajectory as the
// program, bit for bit.
#include <iostream>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/slam/open_slam.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: minimal TUM_FOLDER CAMERA TRAJECTORY (a preset such as tum-fr1, or a YAML file)\n";
    return 2;
  }
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  const auto slam = roslam::open_slam(source.camera());
  while (const auto frame = source.next()) {
    const roslam::FrameResult result = slam->process(*frame);
    if (!result.is_used()) {
      std::cerr << "frame " << result.index << ": " << roslam::describe(result.rejected) << "\n";
    } else if (result.T_world_camera) {
      std::cout << std::fixed << result.timestamp << " " << result.T_world_camera->translation().transpose()
                << "\n";
    }
  }
  slam->finish();
  roslam::write_trajectory(argv[3], slam->trajectory());
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
