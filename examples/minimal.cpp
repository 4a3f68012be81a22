// SPDX-License-Identifier: BSD-3-Clause
// The whole of RO-SLAM in a few lines: frames in, poses out.
#include <iostream>

#include "roslam/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/sources/tum_source.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: minimal TUM_FOLDER CAMERA TRAJECTORY (a preset such as tum-fr1, or a YAML file)\n";
    return 2;
  }
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  // Geometry finds what moves; a roslam::PspnetSegmenter, as the last argument, adds labels.
  roslam::Slam slam(source.camera());
  while (const auto frame = source.next()) {
    const auto result = slam.process(*frame);
    if (!result || !result->T_world_camera) continue;  // unusable picture, or tracking is lost
    std::cout << std::fixed << result->timestamp << " " << result->T_world_camera->translation().transpose()
              << "\n";
  }
  slam.finish();
  roslam::write_trajectory(argv[3], slam.trajectory());
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
