// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/depth_noise.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Estimates the noise of a depth camera from images of known pose: what is static and seen twice has the
/// same depth twice but for the noise of both images. Medians of the errors of inverse depth, by distance, so
/// that things that move and depth edges do not matter. What the errors of the poses add is part of it, as it
/// is in every comparison of two images. Not thread safe.
class DepthNoiseEstimator {
 public:
  explicit DepthNoiseEstimator(const Camera& camera);

  /// Adds an image, CV_32FC1 metres, 0 = unknown. excluded: empty, or CV_8UC1, nonzero where things move.
  /// timestamp: seconds, ascending.
  void add(const cv::Mat& depth, const cv::Mat& excluded, const SE3& T_camera_world, double timestamp);

  /// To be called when the poses before and after have nothing in common, as in another submap.
  void interrupt() { reference_.reset(); }

  /// Nothing before enough was seen. The constant part shows only on surfaces nearer than a metre.
  std::optional<DepthNoise> estimate() const;

  /// Of one range of distances.
  struct Band {
    double depth = 0.0;  ///< metres, mean of the range
    double sigma = 0.0;  ///< metres, standard deviation of the depth
    std::size_t samples = 0;
  };
  std::vector<Band> bands() const;  ///< those with enough samples, nearest first

 private:
  static constexpr std::size_t kBands = 12;
  static constexpr std::size_t kBins = 64;

  struct Point {
    Eigen::Vector3f ray;  // of the pixel, depth 1
    cv::Point pixel;      // as taken
  };
  struct Reference {
    double timestamp;
    SE3 T_camera_world;
    std::vector<Eigen::Vector3f> points;  // of its camera, metres
  };

  void compare(const cv::Mat& depth, const cv::Mat& excluded, const SE3& T_camera_world);

  Camera camera_;
  std::vector<Point> grid_;
  std::optional<Reference> reference_;
  struct Histogram {
    std::array<double, kBins> count{};  // of errors of inverse depth
    double samples = 0.0;
    double depth = 0.0;  // metres, sum
  };
  std::array<Histogram, kBands> histograms_;
};

}  // namespace roslam
