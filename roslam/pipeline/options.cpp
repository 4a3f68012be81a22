// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/options.hpp"

#include "roslam/error.hpp"

namespace roslam {

void ThreadOptions::validate() const {
  if (frame_queue < 1 || frame_queue > 1000) throw OptionsError("threads.frame_queue must be 1 to 1000");
  if (keyframe_queue < 1 || keyframe_queue > 1000)
    throw OptionsError("threads.keyframe_queue must be 1 to 1000");
  if (!(segmentation_timeout > 0.0 && segmentation_timeout <= 3600.0))
    throw OptionsError("threads.segmentation_timeout must be above 0 and at most 3600 seconds");
}

void Options::validate() const {
  orb.validate();
  depth.validate();
  noise.validate();
  segmenter.validate();
  removal.validate();
  matcher.validate();
  pose.validate();
  local_map.validate();
  relocaliser.validate();
  tracker.validate();
  keyframes.validate();
  landmarks.validate();
  fusion.validate();
  culling.validate();
  bundle.validate();
  loop.validate();
  place_check.validate();
  loop_closer.validate();
  pose_graph.validate();
  restoration.validate();
  reprojection.validate();
  invention.validate();
  depth_completion.validate();
  dense.validate();
  threads.validate();
}

Tracker::Settings Options::tracker_settings() const {
  return {tracker, matcher, pose, local_map, place_check, relocaliser, noise};
}

DynamicRemoval::Settings Options::removal_settings() const { return {removal, depth, noise, pose}; }

StaticSceneRestorer::Settings Options::restorer_settings() const {
  return {restoration, reprojection, invention, depth_completion, depth};
}

LocalMapper::Settings Options::mapper_settings() const {
  return {landmarks, fusion, culling, bundle, matcher, noise};
}

LoopCloser::Settings Options::loop_settings() const {
  return {loop, loop_closer, pose_graph, {place_check, matcher, pose, noise}, fusion, bundle};
}

}  // namespace roslam
