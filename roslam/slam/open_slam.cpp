// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/open_slam.hpp"

#include <iostream>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/place_recognition/vocabulary.hpp"
#include "roslam/restoration/inpainter.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/version.hpp"

namespace roslam {

namespace {
using Note = std::function<void(const std::string&)>;

// Null where nothing is to be labelled. A session without labels is still worth tracking.
std::shared_ptr<Segmenter> segmenter_of(const SlamSetup& setup, Options& options, const Note& note) {
  if (!options.dynamic_objects.labels) return nullptr;
  const auto file = setup.segmentation_model.empty() ? find_segmentation_model() : setup.segmentation_model;
  if (!file.empty()) {
    auto segmenter = std::make_shared<PspnetSegmenter>(file, options.segmenter, setup.backend);
    if (!segmenter->note().empty()) note(segmenter->note());
    return segmenter;
  }
  options.dynamic_objects.labels = false;
  note(std::string(missing_segmentation_model().what()) +
       (options.dynamic_objects.is_on() ? "; dynamic objects are found by geometry alone"
                                        : "; dynamic objects are not removed"));
  return nullptr;
}

// Null where no loop is to be closed.
std::shared_ptr<const Vocabulary> vocabulary_of(const SlamSetup& setup, Options& options, const Note& note) {
  if (!options.loop.enabled) return nullptr;
  auto vocabulary = open_vocabulary(setup.vocabulary);
  if (vocabulary == nullptr) {
    options.loop.enabled = false;
    note(
        "models/roslam-orb.vocabulary: not found beside the program; no loop is closed. Install it, set "
        "ROSLAM_MODEL_PATH or name it with --vocabulary");
  }
  return vocabulary;
}

// Null where no network is: holes are then filled by diffusion.
std::shared_ptr<Inpainter> inpainter_of(const SlamSetup& setup, const Note& note) {
  auto inpainter = open_inpainter(setup.restoration_models, setup.backend);
  if (inpainter && !inpainter->note().empty()) note(inpainter->note());
  if (inpainter == nullptr)
    note(
        "models/roslam-restorer-*.onnx: not found beside the program; what no frame shows is filled by "
        "diffusion (Telea); install them, set ROSLAM_MODEL_PATH or name their folder with --models");
  return inpainter;
}
}  // namespace

std::unique_ptr<Slam> open_slam(const Camera& camera, Options options, Mode mode, const SlamSetup& setup) {
  const Note note =
      setup.on_note ? setup.on_note : [](const std::string& text) { std::cerr << "note: " << text << "\n"; };
  if (setup.opencv_threads > 0) cv::setNumThreads(setup.opencv_threads);
  if (!kHasDense && options.dense.enabled) {
    options.dense.enabled = false;
    note("this library was built without the dense map (ROSLAM_DENSE); none is made");
  }
  std::optional<SavedMap> map;
  if (!setup.map.empty()) map = load_map(setup.map);
  auto segmenter = segmenter_of(setup, options, note);
  auto vocabulary = vocabulary_of(setup, options, note);
  auto slam = std::make_unique<Slam>(camera, options, mode, std::move(segmenter), std::move(vocabulary));
  if (map) slam->load_map(std::move(*map));
  if (!options.keyframes.enabled) return slam;
  if (options.dense.enabled) slam->enable_dense_mapping();
  const bool dense_needs_it = options.dense.enabled && options.dense.restore && options.dense.remove;
  if ((setup.restore_keyframes || dense_needs_it) && options.dynamic_objects.is_on())
    slam->enable_restoration(inpainter_of(setup, note), setup.on_restored);
  return slam;
}

}  // namespace roslam
