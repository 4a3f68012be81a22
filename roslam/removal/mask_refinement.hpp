// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/features/observed_frame.hpp"
#include "roslam/removal/cell_grid.hpp"

namespace roslam {

/// Fits the border of a mask to the edges of depth: within a band around the border, pixels about as deep as
/// the mask's inside nearby belong to it and others do not; where the depth is unknown the mask stays as it
/// is. mask: CV_8UC1 of the picture's size. depth: CV_32FC1 metres. depth_cells and barrier (nonzero: nothing
/// is added) are images of cells. band: pixels.
cv::Mat refine_mask(const cv::Mat& mask, const cv::Mat& depth, const cv::Mat& depth_cells,
                    const cv::Mat& barrier, const CellGrid& grid, int band);

/// Dilates by so many pixels in every direction.
cv::Mat dilated(const cv::Mat& mask, int pixels);

/// Dilates a part of a mask by so many pixels, without what the rest of the mask, dilated as far, covers.
/// Both CV_8UC1, 255 where set.
cv::Mat dilated_apart(const cv::Mat& part, const cv::Mat& mask, int pixels);

}  // namespace roslam
