// SPDX-License-Identifier: BSD-3-Clause
// A dense map of the static scene: points and triangles for people, free and occupied space for planners.
#include <filesystem>
#include <iostream>
#include <memory>

#include "roslam/cloud/occupancy.hpp"
#include "roslam/cloud/surface_file.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sources/tum_source.hpp"

int main(int argc, char** argv) try {
  if (argc != 5) {
    std::cerr << "usage: dense_map TUM_FOLDER CAMERA MODELS OUT\n";
    return 2;
  }
  const std::filesystem::path models = argv[3], out = argv[4];
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  roslam::Options options;
  options.dense.voxel_size = 0.05;  // metres
  roslam::Slam slam(source.camera(), options, roslam::Mode::kDeterministic,
                    std::make_shared<roslam::PspnetSegmenter>(models / "roslam-pspnet.onnx"));
  slam.map_densely();
  slam.restore_keyframes(nullptr);  // a roslam::Inpainter paints better what nobody saw
  while (const auto frame = source.next()) slam.process(*frame);
  slam.finish();

  const roslam::DenseMap map = *slam.dense_map();
  std::filesystem::create_directories(out);
  roslam::write_surface_ply(out / "map.ply", map.surface, true);
  if (map.occupancy) map.occupancy->write(out / "map.bt");
  std::cout << map.surface.points.size() << " points from " << map.keyframes << " keyframes\n";
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
