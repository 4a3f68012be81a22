// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/removal/dynamic_removal.hpp"

namespace roslam {

/// Colour of what may move in pictures (BGR); of points that were kept for kNone.
cv::Vec3b removal_colour(Movable kind);

/// What each pixel was removed for: CV_8UC1 of that size, Movable as a number; 0 = kept. With the margin
/// around things, for which the nearest thing counts.
cv::Mat removed_kinds(const Removal& removal, const cv::Size& size);

/// The kind at a point (pixels) of such an image.
Movable kind_at(const cv::Mat& kinds, const cv::Point2f& point);

/// The frame with what moves tinted and outlined, each thing with its number and class, the points that were
/// kept as dots and those that were removed as crosses in the colour of what they lie on. All CV_8UC3; points
/// in pixels of the frame.
cv::Mat removal_picture(const cv::Mat& colour, const Removal& removal, const std::vector<cv::Point2f>& points,
                        const std::vector<cv::Point2f>& removed_points);

/// Pictures side by side in rows of so many, shrunk to that width each, with a legend below.
cv::Mat removal_strip(const std::vector<cv::Mat>& pictures, int columns, int width);

}  // namespace roslam
