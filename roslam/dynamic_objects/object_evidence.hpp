// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/dynamic_objects/depth_consistency.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/dynamic_objects/flow_consistency.hpp"
#include "roslam/dynamic_objects/movable_object.hpp"

namespace roslam {

/// Geometric evidence of the motion of one object.
struct ObjectEvidence {
  int cells = 0;             ///< of the object
  int known = 0;             ///< cells with a result of depth consistency
  int moving = 0;            ///< cells that earlier frames saw as free space
  int at_rest_briefly = 0;   ///< cells with the same surface as some tenths of a second ago
  int at_rest_long = 0;      ///< cells with the same surface as DynamicObjectOptions::rest ago
  int flow_moving = 0;       ///< tracked points that move
  int flow_at_rest = 0;      ///< tracked points that do not
  bool is_flow_fine = true;  ///< false: flow is too noisy to tell slow objects from static ones
};

/// Evidence for each number in owners (CV_32SC1 of cells, 0 = none); the result has count + 1 entries, the
/// first for cells without an owner.
std::vector<ObjectEvidence> evidence_by_owner(const cv::Mat& owners, std::size_t count,
                                              const DepthEvidence& depth, const TrackedPoints& flow,
                                              const CellGrid& grid, const DynamicObjectOptions& options);

/// True if geometry shows that an object has been static for DynamicObjectOptions::rest.
bool has_rested(const ObjectEvidence& evidence, const DynamicObjectOptions& options);

/// True if all enabled geometric checks show that an object is static now. Weaker than has_rested(): enough
/// to reject a label of low confidence.
bool seems_at_rest(const ObjectEvidence& evidence, const DynamicObjectOptions& options);

/// True if tracked points show that an unlabelled object, moving by depth consistency, is static.
bool contradicts_motion(const ObjectEvidence& evidence);

}  // namespace roslam
