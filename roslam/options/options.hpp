// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/dense/dense_options.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/estimation/estimation_options.hpp"
#include "roslam/features/feature_options.hpp"
#include "roslam/loop_closing/loop_closing_options.hpp"
#include "roslam/mapping/mapping_options.hpp"
#include "roslam/matching/matcher_options.hpp"
#include "roslam/options/mode.hpp"
#include "roslam/place_recognition/geometric_verifier_options.hpp"
#include "roslam/restoration/restoration_options.hpp"
#include "roslam/semantics/segmenter_options.hpp"
#include "roslam/stereo/stereo_options.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

struct ROSLAM_EXPORT ThreadOptions {
  int frame_queue = 2;     ///< frames that may wait for the tracker in real-time mode before one is dropped
  int keyframe_queue = 3;  ///< keyframes that may wait for the mapper in real-time mode
  double segmentation_timeout = 10.0;  ///< seconds a network may take for a frame before it is given up

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Everything that can be set, one section a component. A configuration file has the same sections.
struct ROSLAM_EXPORT Options {
  OrbOptions orb;
  DepthOptions depth;
  StereoOptions stereo;
  MeasurementNoise noise;
  SegmenterOptions segmenter;
  DynamicObjectOptions dynamic_objects;
  MatcherOptions matcher;
  PoseOptimiserOptions pose;
  LocalMapOptions local_map;
  RelocaliserOptions relocaliser;
  TrackerOptions tracker;
  PlausibilityOptions plausible;
  KeyframePolicyOptions keyframes;
  NewLandmarkOptions landmarks;
  FusionOptions fusion;
  CullingOptions culling;
  BundleAdjustmentOptions bundle;
  LoopDetectorOptions loop;
  GeometricVerifierOptions geometric_verifier;
  LoopCloserOptions loop_closer;
  PoseGraphOptions pose_graph;
  RestorationOptions restoration;
  ReprojectionOptions reprojection;
  InpaintingOptions inpainting;
  DepthCompletionOptions depth_completion;
  DenseOptions dense;
  ThreadOptions threads;

  /// Throws OptionsError naming the first field out of range.
  void validate() const;
};

/// Reads a configuration file (YAML); what it does not name keeps its default. Throws InputError for a file
/// that is missing or not YAML, OptionsError naming a key that is unknown, of the wrong type or out of range.
ROSLAM_EXPORT Options read_options(const std::filesystem::path& file);

/// The effective options as a configuration file that read_options reads back to the same values.
ROSLAM_EXPORT std::string options_to_yaml(const Options& options);

/// The effective options as a JSON object.
ROSLAM_EXPORT std::string options_to_json(const Options& options);

/// Reads back what options_to_json wrote, perhaps in another version: keys it lacks keep their default, those
/// it has beyond ours are passed over. Throws OptionsError if the text is no JSON object of sections or a
/// value is of the wrong type or out of range.
ROSLAM_EXPORT Options options_from_json(const std::string& text);

}  // namespace roslam
