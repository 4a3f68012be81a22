// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/options/options.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

// What each component takes of the options.

inline Tracker::Settings tracker_settings(const Options& o) {
  return {o.tracker,     o.plausible, o.matcher,
          o.pose,        o.local_map, o.geometric_verifier,
          o.relocaliser, o.noise,     o.dynamic_objects.resting_weight};
}

inline DynamicObjectDetector::Settings detector_settings(const Options& o) {
  return {o.dynamic_objects, o.depth, o.noise, o.pose};
}

inline LocalMapper::Settings mapper_settings(const Options& o) {
  return {o.landmarks, o.fusion, o.culling, o.bundle, o.matcher, o.noise};
}

inline LoopCloser::Settings loop_settings(const Options& o) {
  return {o.loop,   o.loop_closer, o.pose_graph, {o.geometric_verifier, o.matcher, o.pose, o.noise},
          o.fusion, o.bundle};
}

inline StaticSceneRestorer::Settings restorer_settings(const Options& o) {
  return {o.restoration, o.reprojection, o.inpainting, o.depth_completion, o.depth};
}

}  // namespace roslam
