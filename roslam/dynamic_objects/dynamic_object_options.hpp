// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// How dynamic objects are detected and removed (section 3.2, eq. 11, and what the paper leaves open).
struct ROSLAM_EXPORT DynamicObjectOptions {
  // Sources of evidence.
  bool labels = true;             ///< semantic labels of persons, cars and bicycles; needs a Segmenter
  bool depth_consistency = true;  ///< a surface in space that earlier frames saw through has moved there
  bool flow = true;               ///< sparse optical flow that differs from the camera's motion
  bool carry = true;              ///< objects are tracked; false: labels count for their own frame only
  bool refine = true;             ///< mask borders are fitted to depth edges; false: as the network drew them

  // Labels.
  int label_every = 1;               ///< frames; in deterministic mode every n-th is labelled
  double max_labelled_share = 0.9;   ///< of the image; labels with a larger movable part are rejected
  double min_object_share = 0.0005;  ///< of the image; smaller objects are ignored as noise
  double min_confidence = 0.5;       ///< mean probability that brief geometric evidence cannot overrule
  bool keep_resting = false;         ///< labelled objects that geometry sees at rest are not removed
  double keep_missed = 0.5;          ///< seconds that an object of min_confidence is kept if labels miss it

  // Geometry.
  double history = 2.5;                ///< seconds of depth images that a frame is compared with
  double history_interval = 0.25;      ///< seconds between two depth images that are kept
  double depth_tolerance = 0.03;       ///< share of the depth, beside three sigmas of noise, that may differ
  double appearance_tolerance = 20.0;  ///< grey levels, at most, by which the background may look different
  double flow_interval = 0.13;         ///< seconds over which points are tracked to detect motion
  double flow_tolerance = 3.5;         ///< sigmas that a static point may differ from its predicted position
  double rest = 2.0;  ///< seconds without motion after which an object of min_confidence is at rest

  // From evidence to mask.
  double growth = 0.15;  ///< metres that a mask grows at most along the surface of the object
  int edge_band = 10;    ///< pixels around the border of a mask within which depth decides
  int margin = 4;        ///< pixels by which the finished mask is dilated

  // Points on labelled objects at rest, never mapped.
  double resting_weight = 0.5;  ///< of their errors in the pose, in that of others; 0: they are not used
  int scarce_points = 100;      ///< static points below which those on objects at rest are used for tracking

  /// Throws OptionsError naming the field.
  void validate() const;

  bool is_on() const { return labels || depth_consistency || flow; }

  bool operator==(const DynamicObjectOptions&) const = default;
};

/// The modes of `--dynamic`:
///   none           nothing is removed, as in ORB-SLAM2
///   labels         objects labelled as movable are removed
///   geometry       objects that depth and optical flow show moving are removed
///   both           labels and geometry: RO-SLAM
///   ds-slam-like   labelled objects are removed unless optical flow finds them at rest, as are unlabelled
///                  objects that it finds moving; as in DS-SLAM (Yu et al., IROS 2018)
///   dynaslam-like  all labelled objects are removed, at rest or not, and what contradicts the depth of
///                  earlier frames, as in DynaSLAM (Bescos et al., RA-L 2018)
/// The last two combine the parts and the network of RO-SLAM in that manner; they are not those systems.
ROSLAM_EXPORT std::vector<std::string> dynamic_modes();

/// base, set to one of these modes. Nothing for an unknown name.
ROSLAM_EXPORT std::optional<DynamicObjectOptions> options_of_mode(std::string_view mode,
                                                                  const DynamicObjectOptions& base = {});

/// The mode whose options these are exactly; otherwise "both" with labels, "geometry" without.
ROSLAM_EXPORT std::string_view mode_of(const DynamicObjectOptions& options);

}  // namespace roslam
