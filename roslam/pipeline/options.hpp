// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "roslam/cloud/dense_options.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/loop/loop_closer.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/removal/dynamic_removal.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/tracking/keyframe_policy.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

/// How the stages run.
enum class Mode {
  kDeterministic,  ///< one after the other; the same input gives the same bytes
  kRealTime        ///< on threads joined by bounded queues; frames are dropped and counted rather than queued
};

struct ThreadOptions {
  int frame_queue = 2;     ///< frames that may wait for the tracker in real-time mode; older ones are dropped
  int keyframe_queue = 3;  ///< keyframes that may wait for the mapper in real-time mode
  double segmentation_timeout = 10.0;  ///< seconds a network may take for a frame before it is given up

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Everything that can be set, one section a component. A configuration file has the same sections.
struct Options {
  OrbOptions orb;
  DepthOptions depth;
  MeasurementNoise noise;
  SegmenterOptions segmenter;
  RemovalOptions removal;
  MatcherOptions matcher;
  PoseOptimiserOptions pose;
  LocalMapOptions local_map;
  RelocaliserOptions relocaliser;
  TrackerOptions tracker;
  KeyframePolicyOptions keyframes;
  NewLandmarkOptions landmarks;
  FusionOptions fusion;
  CullingOptions culling;
  BundleAdjustmentOptions bundle;
  LoopDetectorOptions loop;
  PlaceCheckOptions place_check;
  LoopCloserOptions loop_closer;
  PoseGraphOptions pose_graph;
  RestorationOptions restoration;
  ReprojectionOptions reprojection;
  InventionOptions invention;
  DepthCompletionOptions depth_completion;
  DenseOptions dense;
  ThreadOptions threads;

  /// Throws OptionsError naming the first field out of range.
  void validate() const;

  Tracker::Settings tracker_settings() const;
  LocalMapper::Settings mapper_settings() const;
  LoopCloser::Settings loop_settings() const;
  DynamicRemoval::Settings removal_settings() const;
  StaticSceneRestorer::Settings restorer_settings() const;
};

/// Reads a configuration file (YAML); what it does not name keeps its default. Throws InputError for a file
/// that is missing or not YAML, OptionsError naming a key that is unknown, of the wrong type or out of range.
Options read_options(const std::filesystem::path& file);

/// The effective options as a configuration file that read_options reads back to the same values.
std::string options_to_yaml(const Options& options);

/// The effective options as a JSON object.
std::string options_to_json(const Options& options);

/// Reads back what options_to_json wrote, perhaps in another version: keys it lacks keep their default, those
/// it has beyond ours are passed over. Throws OptionsError if the text is no JSON object of sections or a
/// value is of the wrong type or out of range.
Options options_from_json(const std::string& text);

}  // namespace roslam
