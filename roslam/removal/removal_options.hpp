// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace roslam {

/// How things that move are found and removed (section 3.2, eq. 11, and what the paper leaves open).
struct RemovalOptions {
  // What is consulted.
  bool labels = true;      ///< a network's labels of persons, cars and bicycles; needs a Segmenter
  bool free_space = true;  ///< depth: what stands where earlier frames saw through has moved there
  bool flow = true;        ///< sparse optical flow: what moves otherwise than the camera makes it seem
  bool carry = true;   ///< masks follow their things from frame to frame; false: labels count for their frame
  bool refine = true;  ///< masks are fitted to the edges of depth; false: as the network drew them

  // Labels.
  int label_every = 1;              ///< frames; in deterministic mode every n-th is labelled
  double max_labelled_share = 0.9;  ///< of the picture; a network that labels more as movable is not believed
  double min_object_share = 0.0005;  ///< of the picture; smaller things are not told apart from noise
  double sure = 0.5;                 ///< mean probability from which a label is believed against quick doubts
  bool keep_resting = false;         ///< labelled things that geometry sees at rest are not removed
  double keep_missed = 0.5;          ///< seconds that a thing is kept which newer labels miss

  // Geometry.
  double history = 2.5;            ///< seconds of depth that a frame is compared with
  double history_interval = 0.25;  ///< seconds between two depth images that are kept
  double depth_tolerance = 0.03;   ///< share of the depth, beside three sigmas of its noise, that may be off
  double flow_interval = 0.13;     ///< seconds over which points are followed to see whether they move
  double flow_tolerance = 3.5;     ///< sigmas a point may be off where a point at rest would be
  double rest = 2.0;  ///< seconds without motion after which a surely labelled thing counts as at rest

  // From evidence to mask.
  double growth = 0.15;  ///< metres that a mask grows at most along the surface of the thing
  int edge_band = 10;    ///< pixels around the border of a mask within which depth decides what belongs to it
  int margin = 4;        ///< pixels by which the finished mask is dilated

  // When most of the view moves.
  int scarce_points = 100;  ///< static points below which those on things at rest help for the moment

  /// Throws OptionsError naming the field.
  void validate() const;

  bool is_on() const { return labels || free_space || flow; }

  bool operator==(const RemovalOptions&) const = default;
};

/// What `--dynamic` knows, and how other systems are stood in for:
///   none           nothing is removed, as in ORB-SLAM2
///   labels         what a network labels as movable goes
///   geometry       what depth and optical flow show to move goes
///   both           the two together: RO-SLAM
///   ds-slam-like   labelled things go unless the optical flow finds them at rest, as in DS-SLAM (Yu et al.,
///                  IROS 2018), and so do unlabelled things that it sees moving
///   dynaslam-like  all labelled things go, at rest or not, and what the depth of earlier views contradicts,
///   as
///                  in DynaSLAM (Bescos et al., RA-L 2018)
/// The last two are our parts put together in their manner, with our network; they are not those systems.
std::vector<std::string> removal_modes();

/// base in one of these modes. Nothing for another name.
std::optional<RemovalOptions> removal_from(std::string_view mode, const RemovalOptions& base = {});

/// The name of the mode that these options are in; of those like other systems only if they are so in full.
std::string_view mode_of(const RemovalOptions& options);

}  // namespace roslam
