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

/// The bounding box of each number from 1 to count in an image of numbers (CV_32SC1 or CV_16UC1); the first
/// entry is empty. Numbers that do not occur have empty boxes.
std::vector<cv::Rect> boxes_of_numbers(const cv::Mat& numbers, int count);

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
  cv::Rect cells_of(const cv::Rect& pixels) const;  ///< all cells that a rectangle of pixels touches

  /// Direction to a cell's centre in the camera frame, at depth 1.
  const Eigen::Vector3f& ray(std::size_t cell) const { return rays_[cell]; }

  /// Maps a point of the camera frame (metres, z > 0) to (column, row, 1) times z of the table that cell_at()
  /// looks up.
  const Eigen::Matrix3f& projection() const { return projection_; }

  /// The cell seen at a column and a row of the look-up table; -1 outside the image.
  int cell_at(float column, float row) const {
    const bool inside = column >= 0.0F && row >= 0.0F && column < static_cast<float>(table_size_.width) &&
                        row < static_cast<float>(table_size_.height);
    return inside ? table_[static_cast<std::size_t>(static_cast<int>(row) * table_size_.width +
                                                    static_cast<int>(column))]
                  : -1;
  }

  /// Length in metres of a cell's side at that depth.
  float side_at(float depth) const { return metres_per_depth_ * depth; }

  /// CV_32FC1, metres: depth at the centre of each cell; 0 where unknown or at a depth discontinuity.
  cv::Mat depth_cells(const cv::Mat& depth, const DepthOptions& options) const;

  /// CV_8UC1: mean of each cell of a grey image (CV_8UC1).
  cv::Mat grey_cells(const cv::Mat& grey) const;

  /// CV_8UC1: 255 for each cell whose centre is set in a mask of the image, or of a rectangle of cells.
  cv::Mat mask_cells(const cv::Mat& mask) const { return mask_cells(mask, cv::Rect({0, 0}, size_)); }
  cv::Mat mask_cells(const cv::Mat& mask, const cv::Rect& area) const;

  /// The pixels of a rectangle of cells, and an image of such cells enlarged to them: each pixel has its
  /// cell's value.
  cv::Rect pixels_of(const cv::Rect& cells) const;
  cv::Mat in_pixels(const cv::Mat& values, const cv::Rect& cells) const;

 private:
  Camera camera_;
  int side_;
  cv::Size size_;
  float metres_per_depth_;
  std::vector<Eigen::Vector3f> rays_;
  // Look-up table from undistorted pixels, in steps of a cell, to cells.
  Eigen::Matrix3f projection_;
  cv::Size table_size_;
  std::vector<int> table_;
};

}  // namespace roslam
