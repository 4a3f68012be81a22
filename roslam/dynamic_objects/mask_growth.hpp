// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/dynamic_objects/cell_grid.hpp"

namespace roslam {

/// Constraints on the growth of masks; all images of cells.
struct GrowthField {
  const cv::Mat& depth;    ///< CV_32FC1 metres, 0 = unknown: no growth there
  const cv::Mat& barrier;  ///< CV_8UC1, nonzero: known to be static, no growth there
  const cv::Mat& seeds;    ///< CV_8UC1, nonzero: growth may start there
  const cv::Mat& moving;   ///< CV_8UC1, nonzero: known to move, growth costs nothing there
};

/// Region growing of numbered areas over the surface they lie on: from cell to cell while the depth is
/// continuous, at most max_metres from the seeds. owners: CV_32SC1 of cells, number of the area
/// or 0; is changed.
void grow_masks(cv::Mat& owners, const GrowthField& field, const CellGrid& grid, double max_metres);

}  // namespace roslam
