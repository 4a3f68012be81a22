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

namespace roslam {

/// Errors of depth relative to the truth, where both are known.
class DepthErrorHistogram {
 public:
  void add(float truth, float estimate);
  std::size_t count() const { return count_; }
  double median() const;  ///< share of the depth, to 0.05 %; NaN without values

 private:
  static constexpr std::size_t kBins = 2000;
  std::array<std::size_t, kBins + 1> bins_{};  // the last: 100 % and more
  std::size_t count_ = 0;
};

/// How close what fills the holes comes to what is there. Values are NaN where there is nothing to tell.
struct RestorationError {
  bool interrupted = false;   ///< pictures are missing at the end
  std::size_t pictures = 0;   ///< compared
  std::size_t with_hole = 0;  ///< of them with a hole of at least 100 pixels, which alone are scored
  std::uint64_t pixels = 0;   ///< of those pictures
  std::uint64_t hole_pixels = 0;
  std::uint64_t reprojected_pixels = 0;
  std::uint64_t invented_pixels = 0;

  // Means over pictures of what is inside the hole.
  double psnr = 0.0;  ///< dB
  double ssim = 0.0;
  double l1 = 0.0;  ///< grey levels

  // Over all pixels of a provenance.
  double psnr_reprojected = 0.0;         ///< dB
  double psnr_invented = 0.0;            ///< dB
  double depth_error_reprojected = 0.0;  ///< median share of the true depth
  double depth_error_invented = 0.0;     ///< median share of the true depth
  double depth_known = 0.0;              ///< share of the hole's pixels of known true depth that have one

  std::size_t true_points = 0;     ///< ORB points that the truth has in the holes
  std::size_t points = 0;          ///< that the restored pictures have there
  std::size_t matched_points = 0;  ///< true points found again within 3 pixels by their descriptor

  double movable_share = 0.0;  ///< of the invented pixels, those a network takes for what may move
};

/// A restored picture and what is true.
struct RestoredPicture {
  cv::Mat truth;            ///< CV_8UC3
  cv::Mat estimate;         ///< CV_8UC3
  cv::Mat hole;             ///< CV_8UC1, nonzero where it was restored
  cv::Mat provenance;       ///< CV_8UC1, values of Provenance; empty = not known
  cv::Mat true_depth;       ///< CV_32FC1 metres, 0 = unknown; empty = not known at all
  cv::Mat estimated_depth;  ///< the same
  cv::Mat
      movable;  ///< CV_8UC1, nonzero where a network sees what may move in the estimate; empty = not asked
};

/// Compares any number of pictures.
class RestorationComparison {
 public:
  /// All images must be of one size. Throws InputError if sizes or types differ.
  void add(const RestoredPicture& picture);
  RestorationError error() const;

 private:
  void add_depths(const RestoredPicture& picture);
  void add_points(const RestoredPicture& picture);

  // Of pixels of one provenance.
  struct Squares {
    double sum = 0.0;
    std::uint64_t pixels = 0;
    void add(const RestoredPicture& picture, const cv::Mat& where);
    double psnr() const;
  };

  OrbExtractor extractor_;
  RestorationError counts_;
  std::vector<double> psnrs_, ssims_, l1s_;
  Squares reprojected_, invented_;
  DepthErrorHistogram depth_reprojected_, depth_invented_;
  std::uint64_t truth_known_ = 0, both_known_ = 0;
  std::uint64_t labelled_ = 0, movable_ = 0;
};

/// A Markdown table that also reads well as plain text, and one JSON object (null where there is no value).
std::string to_markdown(const RestorationError& error);
std::string to_json(const RestorationError& error);

}  // namespace roslam
