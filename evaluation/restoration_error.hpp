// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/features/orb_extractor.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"

namespace roslam::evaluation {

/// Histogram of depth errors relative to the truth.
class DepthErrorHistogram {
 public:
  void add(float truth, float estimate);
  std::size_t count() const { return count_; }
  double median() const;  ///< share of the true depth, to 0.05 %; NaN without values

 private:
  static constexpr std::size_t kBins = 2000;
  std::array<std::size_t, kBins + 1> bins_{};  // the last: errors of 100 % and more
  std::size_t count_ = 0;
};

/// Errors of restored images inside their holes. Values without data are NaN.
struct RestorationError {
  bool interrupted = false;   ///< the last images are missing
  std::size_t images = 0;     ///< compared
  std::size_t with_hole = 0;  ///< of them with holes of 100 pixels or more, which alone are scored
  std::uint64_t pixels = 0;   ///< of those images
  std::uint64_t hole_pixels = 0;
  std::uint64_t reprojected_pixels = 0;
  std::uint64_t inpainted_pixels = 0;

  // Means over images, inside the holes.
  double psnr = 0.0;  ///< dB
  double ssim = 0.0;
  double l1 = 0.0;  ///< grey levels

  // Over all pixels of a provenance.
  double psnr_reprojected = 0.0;         ///< dB
  double psnr_inpainted = 0.0;           ///< dB
  double depth_error_reprojected = 0.0;  ///< median share of the true depth
  double depth_error_inpainted = 0.0;    ///< median share of the true depth
  double depth_known = 0.0;              ///< share of hole pixels of known true depth that have an estimate

  std::size_t true_points = 0;     ///< ORB points of the true images in the holes
  std::size_t points = 0;          ///< ORB points of the restored images there
  std::size_t matched_points = 0;  ///< true points matched within 3 pixels by their descriptor

  double movable_share = 0.0;  ///< share of inpainted pixels that a network labels as movable
};

/// A restored image and its ground truth, all of one size.
struct EvaluatedImage {
  cv::Mat truth;            ///< CV_8UC3
  cv::Mat estimate;         ///< CV_8UC3
  cv::Mat hole;             ///< CV_8UC1, nonzero where it was restored
  cv::Mat provenance;       ///< CV_8UC1, values of Provenance; empty = not known
  cv::Mat true_depth;       ///< CV_32FC1 metres, 0 = unknown; empty = not known at all
  cv::Mat estimated_depth;  ///< the same
  cv::Mat movable;          ///< CV_8UC1, nonzero where a network labels a movable class; empty = unknown
};

/// Accumulates errors over any number of images.
class RestorationComparison {
 public:
  /// All images must be of one size. Throws InputError if sizes or types differ.
  void add(const EvaluatedImage& image);
  RestorationError error() const;

 private:
  void add_depths(const EvaluatedImage& image);
  void add_points(const EvaluatedImage& image);

  // Squared error of the pixels of one provenance.
  struct Squares {
    double sum = 0.0;
    std::uint64_t pixels = 0;
    void add(const EvaluatedImage& image, const cv::Mat& where);
    double psnr() const;
  };

  OrbExtractor extractor_;
  RestorationError counts_;
  std::vector<double> psnrs_, ssims_, l1s_;
  Squares reprojected_, inpainted_;
  DepthErrorHistogram depth_reprojected_, depth_inpainted_;
  std::uint64_t truth_known_ = 0, both_known_ = 0;
  std::uint64_t labelled_ = 0, movable_ = 0;
};

/// A Markdown table that also reads well as plain text, and one JSON object (null where there is no value).
std::string to_markdown(const RestorationError& error);
std::string to_json(const RestorationError& error);

}  // namespace roslam::evaluation
