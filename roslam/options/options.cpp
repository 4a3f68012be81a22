// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/options/options.hpp"

#include "roslam/common/error.hpp"

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
  stereo.validate();
  noise.validate();
  segmenter.validate();
  dynamic_objects.validate();
  matcher.validate();
  pose.validate();
  local_map.validate();
  relocaliser.validate();
  tracker.validate();
  plausible.validate();
  keyframes.validate();
  landmarks.validate();
  fusion.validate();
  culling.validate();
  bundle.validate();
  loop.validate();
  geometric_verifier.validate();
  loop_closer.validate();
  pose_graph.validate();
  restoration.validate();
  reprojection.validate();
  inpainting.validate();
  depth_completion.validate();
  dense.validate();
  threads.validate();
}

}  // namespace roslam
