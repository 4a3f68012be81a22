// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Divides an image into square cells of a few pixels, so that every frame can be processed in full. Lens
/// distortion is looked up in tables. Images of cells have size() and one value per cell.
class CellGrid {
 public:
  explicit CellGrid(const Camera& camera);

  int side() const { return side_; }  ///< pixels
  cv::Size size() const { return size_; }
  std::size_t cells() const { return static_cast<std::size_t>(size_.area()); }

  /// The pixel at the centre of a cell, in the image as taken (distorted).
  cv::Point pixel_of(const cv::Point& cell) const;
  cv::Point cell_of(const cv::Point2f& pixel) const;

  /// Direction to a cell's centre in the camera frame, at depth 1.
  const Eigen::Vector3f& ray(std::size_t cell) const { return rays_[cell]; }

  /// The cell that a point of the camera frame (metres, z > 0) projects into; -1 outside the image.
  int cell_that_sees(const Eigen::Vector3f& point) const;

  /// Length in metres of a cell's side at that depth.
  float side_at(float depth) const { return metres_per_depth_ * depth; }

  /// CV_32FC1, metres: depth at the centre of each cell; 0 where unknown or at a depth discontinuity.
  cv::Mat depth_cells(const cv::Mat& depth, const DepthOptions& options) const;

  /// CV_8UC1: 255 for each cell whose centre is set in a mask of the image.
  cv::Mat mask_cells(const cv::Mat& mask) const;

  /// An image of cells resized to the image's size: each pixel has its cell's value.
  cv::Mat in_pixels(const cv::Mat& cells) const;

 private:
  Camera camera_;
  int side_;
  cv::Size size_;
  float metres_per_depth_;
  std::vector<Eigen::Vector3f> rays_;
  // Look-up table from undistorted pixels, in steps of a cell, to cells.
  cv::Point2f table_origin_;
  cv::Size table_size_;
  std::vector<int> table_;
};

}  // namespace roslam
