// SPDX-License-Identifier: BSD-3-Clause
// A map that lasts: the first flight makes it, each other finds itself in it, goes on from it and leaves it
// larger.
#include <filesystem>
#include <iostream>
#include <memory>

#include "roslam/atlas/map_file.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/places/vocabulary.hpp"
#include "roslam/sources/tum_source.hpp"

int main(int argc, char** argv) try {
  if (argc != 5) {
    std::cerr
        << "usage: fly_again TUM_FOLDER CAMERA VOCABULARY MAP (models/roslam-orb.vocabulary, map.roslam)\n";
    return 2;
  }
  roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
  // Places are recognised by the words of a vocabulary: without one no loop is closed and no map is met.
  const auto vocabulary = std::make_shared<const roslam::Vocabulary>(roslam::Vocabulary::load(argv[3]));
  const std::filesystem::path map = argv[4];

  roslam::Options options;
  // options.keyframes.enabled = false;  // to fly in the map and leave it as it is
  roslam::Slam slam(source.camera(), options, roslam::Mode::kDeterministic, nullptr, vocabulary);
  const bool goes_on = std::filesystem::exists(map);
  if (goes_on) slam.continue_from(roslam::load_map(map));
  while (const auto frame = source.next()) slam.process(*frame);
  slam.finish();

  if (goes_on && !slam.has_met_map()) {
    std::cerr << "the flight never met " << map.string() << ", which stays as it is\n";
    return 1;
  }
  roslam::save_map(map, slam.snapshot());
  std::cout << slam.trajectory().size() << " poses in a map of " << slam.map().keyframe_ids().size()
            << " keyframes\n";
} catch (const roslam::Error& error) {
  std::cerr << "error: " << error.what() << "\n";
  return 1;
}
