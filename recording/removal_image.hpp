// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/dynamic_object_detector.hpp"

namespace roslam::recording {

/// Display colour of a class of movable objects (BGR); kNone: colour of kept points.
cv::Vec3b removal_colour(Movable kind);

/// The class each pixel was removed as: CV_8UC1 of that size, values of Movable, 0 = kept. Pixels of the
/// margin get the class of the nearest object.
cv::Mat removed_kinds(const DynamicObjects& dynamic_objects, const cv::Size& size);

/// The class at a point (pixels) in an image of removed_kinds().
Movable kind_at(const cv::Mat& kinds, const cv::Point2f& point);

/// The frame with removed objects tinted, outlined and labelled with id and class, kept points as dots and
/// removed points as crosses in the colour of their object. Images CV_8UC3 (BGR); points in pixels.
cv::Mat removal_image(const cv::Mat& colour, const DynamicObjects& dynamic_objects,
                      const std::vector<cv::Point2f>& points, const std::vector<cv::Point2f>& removed_points);

/// Images in a grid of so many columns, each resized to that width (pixels), with a legend below.
cv::Mat removal_strip(const std::vector<cv::Mat>& images, int columns, int width);

}  // namespace roslam::recording
