// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/slam/slam.hpp"

namespace roslam {

/// What open_slam() opens beside the options. Empty names stand for the files that come with RO-SLAM
/// (find_resource()).
struct ROSLAM_EXPORT SlamSetup {
  std::filesystem::path segmentation_model;                 ///< ONNX file of the network that labels pixels
  std::filesystem::path restoration_models;                 ///< folder of the inpainting networks
  std::filesystem::path vocabulary;                         ///< of ORB words, for place recognition
  InferenceBackend backend = InferenceBackend::kAutomatic;  ///< what runs the networks
  std::filesystem::path map;       ///< map.roslam of an earlier session to continue; empty: none
  bool restore_keyframes = false;  ///< restore keyframes even where no dense map needs them restored
  OnRestored on_restored = {};     ///< takes restored keyframes; may be empty

  /// Threads of OpenCV in this process (cv::setNumThreads), which all users of OpenCV in it share; 0 leaves
  /// it as it is. RO-SLAM runs its stages on threads of its own, so that more than one costs latency in
  /// real-time mode.
  int opencv_threads = 1;

  /// Takes notes for the user: a file that is missing and what is switched off therefore. Default: a line on
  /// stderr.
  std::function<void(const std::string& note)> on_note = {};
};

/// The pipeline with all its parts, as `roslam run` has it: loop closing, dynamic object detection with
/// labels, the dense map and the restoration of its keyframes, each where the options enable it. What comes
/// with RO-SLAM but cannot be found (or was not built: components semantics and dense) is switched off with a
/// note. Throws CalibrationError, OptionsError, ModelError, or InputError for files that are named but
/// missing or damaged.
ROSLAM_EXPORT std::unique_ptr<Slam> open_slam(const Camera& camera, Options options = {},
                                              Mode mode = Mode::kDeterministic, const SlamSetup& setup = {});

}  // namespace roslam
