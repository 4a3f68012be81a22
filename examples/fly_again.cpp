// SPDX-License-Identifier: BSD-3-Clause
// A map that is reused: the first session makes it, each later one is localised in it, continues it and saves
// it.
#include <filesystem>
#include <iostream>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/slam/open_slam.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: fly_again TUM_FOLDER CAMERA MAP (map.roslam; made if it does not exist)\n";
    return 2;
  }
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  const std::filesystem::path map = argv[3];

  roslam::Options options;
  options.dense.enabled = false;
  // options.keyframes.enabled = false;  // to localise in the map and leave it as it is
  roslam::SlamSetup setup;
  const bool has_map = std::filesystem::exists(map);
  if (has_map) setup.map = map;
  const auto slam = roslam::open_slam(source.camera(), options, roslam::Mode::kDeterministic, setup);
  while (const auto frame = source.next()) slam->process(*frame);
  slam->finish();

  if (has_map && !slam->found_in_loaded_map()) {
    std::cerr << "no frame was localised in " << map.string() << ", which stays as it is\n";
    return 1;
  }
  roslam::save_map(map, slam->saved_map());
  std::cout << slam->trajectory().size() << " poses in a map of " << slam->map().keyframe_count()
            << " keyframes\n";
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
