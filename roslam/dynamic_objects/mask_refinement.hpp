// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/features/observed_frame.hpp"

namespace roslam {

/// Refines the border of a mask by depth: within a band around the border, pixels in the depth range of the
/// mask's interior nearby belong to it and others do not; where depth is unknown the mask is kept. mask:
/// CV_8UC1, the part of the image whose top left pixel is the origin, a corner of a cell; there is no mask
/// outside. depth: CV_32FC1 of the image, metres. depth_cells and barrier (nonzero: nothing is added) are
/// images of cells. band: pixels.
cv::Mat refine_mask(const cv::Mat& mask, const cv::Mat& depth, const cv::Mat& depth_cells,
                    const cv::Mat& barrier, const CellGrid& grid, int band, const cv::Point& origin = {});

/// Dilates by so many pixels in every direction.
cv::Mat dilated(const cv::Mat& mask, int pixels);

/// Dilates a part of a mask by so many pixels, without what the rest of the mask, dilated as far, covers.
/// Both CV_8UC1, 255 where set.
cv::Mat dilated_apart(const cv::Mat& part, const cv::Mat& mask, int pixels);

}  // namespace roslam
