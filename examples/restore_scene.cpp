// SPDX-License-Identifier: BSD-3-Clause
// Writes each keyframe without dynamic objects: their area is filled from other frames, and what no frame
// shows is inpainted by a network.
#include <filesystem>
#include <iostream>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/sensors/image_file.hpp"
#include "roslam/slam/open_slam.hpp"

int main(int argc, char** argv) try {
  namespace fs = std::filesystem;
  if (argc != 4) {
    std::cerr << "usage: restore_scene TUM_FOLDER CAMERA OUT\n";
    return 2;
  }
  const fs::path out = argv[3];
  fs::create_directories(out);
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  roslam::Options options;
  options.dense.enabled = false;
  roslam::SlamSetup setup;
  setup.restore_keyframes = true;
  setup.on_restored = [&](const roslam::RestoredKeyframe& keyframe) {
    roslam::write_image(out / (std::to_string(keyframe.frame.index) + ".png"), keyframe.view.colour);
    std::cout << "frame " << keyframe.frame.index << ": "
              << keyframe.view.pixels_of(roslam::Provenance::kReprojected) << " pixels from other frames, "
              << keyframe.view.pixels_of(roslam::Provenance::kInpainted) << " inpainted\n";
  };
  const auto slam = roslam::open_slam(source.camera(), options, roslam::Mode::kDeterministic, setup);
  while (const auto frame = source.next()) slam->process(*frame);
  slam->finish();
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
