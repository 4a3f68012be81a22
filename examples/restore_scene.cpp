// SPDX-License-Identifier: BSD-3-Clause
// Writes each keyframe of a flight without the things that move: in their place what the camera saw at other
// times, and what a network makes of the rest.
#include <filesystem>
#include <iostream>
#include <memory>

#include "roslam/error.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sources/image_file.hpp"
#include "roslam/sources/tum_source.hpp"

int main(int argc, char** argv) try {
  namespace fs = std::filesystem;
  if (argc != 5) {
    std::cerr << "usage: restore_scene TUM_FOLDER CAMERA MODELS OUT (MODELS as in share/roslam/models)\n";
    return 2;
  }
  const fs::path models = argv[3], out = argv[4];
  fs::create_directories(out);
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  roslam::Slam slam(source.camera(), {}, roslam::Mode::kDeterministic,
                    std::make_shared<roslam::PspnetSegmenter>(models / "roslam-pspnet.onnx"));
  // Without the network a classic method paints what nobody saw.
  const bool has_network = fs::exists(models / "roslam-restorer-person.onnx");
  slam.restore_keyframes(
      has_network ? std::make_shared<roslam::GanInpainter>(models) : nullptr,
      [&](const roslam::RestoredKeyframe& keyframe) {
        roslam::write_image(out / (std::to_string(keyframe.frame.index) + ".png"), keyframe.view.colour);
        std::cout << "frame " << keyframe.frame.index << ": "
                  << keyframe.view.pixels_of(roslam::Provenance::kReprojected)
                  << " pixels seen at another time, "
                  << keyframe.view.pixels_of(roslam::Provenance::kInvented) << " invented\n";
      });
  while (const auto frame = source.next()) slam.process(*frame);
  slam.finish();
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
