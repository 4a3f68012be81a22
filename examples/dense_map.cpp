// SPDX-License-Identifier: BSD-3-Clause
// A dense map of the static scene: points and triangles, and free and occupied space for planners.
#include <filesystem>
#include <iostream>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "roslam/slam/open_slam.hpp"

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: dense_map TUM_FOLDER CAMERA OUT\n";
    return 2;
  }
  const std::filesystem::path out = argv[3];
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  roslam::Options options;
  options.dense.voxel_size = 0.05;  // metres
  const auto slam = roslam::open_slam(source.camera(), options);
  while (const auto frame = source.next()) slam->process(*frame);
  slam->finish();

  const auto map = slam->dense_map();
  if (!map) {
    std::cerr << "this library was built without the dense map\n";
    return 1;
  }
  std::filesystem::create_directories(out);
  roslam::write_surface_ply(out / "map.ply", map->surface, true);
  if (map->occupancy) map->occupancy->write(out / "map.bt");
  std::cout << map->surface.points.size() << " points from " << map->keyframes << " keyframes\n";
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
