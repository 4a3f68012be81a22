// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/removal/cell_grid.hpp"
#include "roslam/removal/flow_check.hpp"
#include "roslam/removal/free_space.hpp"
#include "roslam/removal/movable_object.hpp"
#include "roslam/removal/removal_options.hpp"

namespace roslam {

/// What geometry says about one object.
struct ObjectEvidence {
  int cells = 0;            ///< of the object
  int known = 0;            ///< cells whose place earlier frames saw
  int moving = 0;           ///< cells that earlier frames saw through
  int at_rest_briefly = 0;  ///< cells with the same surface as some tenths of a second ago
  int at_rest_long = 0;     ///< cells with the same surface as RemovalOptions::rest ago
  int flow_moving = 0;      ///< followed points that move
  int flow_at_rest = 0;     ///< followed points that do not
  bool is_flow_fine =
      true;  ///< false: points at rest are off by so much that slow things would pass for resting
};

/// Counts for each number in owners (CV_32SC1 of cells, 0 = none); the result has count + 1 entries, of which
/// the first is what belongs to nothing.
std::vector<ObjectEvidence> evidence_by_owner(const cv::Mat& owners, std::size_t count,
                                              const FreeSpaceEvidence& space, const FollowedPoints& flow,
                                              const CellGrid& grid, const RemovalOptions& options);

/// True if geometry shows a surely labelled thing to have been where it is for RemovalOptions::rest.
bool rests(const ObjectEvidence& evidence, const RemovalOptions& options);

/// True if geometry shows at a glance that a thing does not move, by all that it was asked for. Enough to
/// drop an uncertain label.
bool seems_at_rest(const ObjectEvidence& evidence, const RemovalOptions& options);

/// True if points on an unlabelled thing that depth holds for moving show that it does not.
bool contradicts_motion(const ObjectEvidence& evidence);

}  // namespace roslam
