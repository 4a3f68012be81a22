// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/restoration_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "evaluation/image_error.hpp"
#include "evaluation/statistics.hpp"
#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kSmallestHole = 100;    // pixels
constexpr float kMatchRadius = 3.0F;  // pixels
constexpr int kMatchDistance = 64;    // bits

double share(std::uint64_t part, std::uint64_t all) {
  return all == 0 ? kNaN : static_cast<double>(part) / static_cast<double>(all);
}

cv::Mat of(const EvaluatedImage& image, Provenance provenance) {
  return (image.provenance == static_cast<double>(provenance)) & (image.hole != 0);
}

std::vector<OrbFeature> points_in_hole(const OrbExtractor& extractor, const cv::Mat& image,
                                       const cv::Mat& hole) {
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  auto points = extractor.extract(grey);
  std::erase_if(points, [&](const OrbFeature& point) {
    return hole.at<std::uint8_t>(std::min(cvRound(point.pixel.y), hole.rows - 1),
                                 std::min(cvRound(point.pixel.x), hole.cols - 1)) == 0;
  });
  return points;
}

bool is_found_in(const OrbFeature& point, const std::vector<OrbFeature>& others) {
  return std::any_of(others.begin(), others.end(), [&](const OrbFeature& other) {
    return std::abs(point.pixel.x - other.pixel.x) <= kMatchRadius &&
           std::abs(point.pixel.y - other.pixel.y) <= kMatchRadius &&
           hamming(point.descriptor, other.descriptor) <= kMatchDistance;
  });
}
}  // namespace

void DepthErrorHistogram::add(float truth, float estimate) {
  const double error = std::abs(static_cast<double>(estimate) / static_cast<double>(truth) - 1.0);
  ++bins_[std::min(static_cast<std::size_t>(error * static_cast<double>(kBins)), kBins)];
  ++count_;
}

double DepthErrorHistogram::median() const {
  if (count_ == 0) return kNaN;
  std::size_t below = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    below += bins_[bin];
    if (2 * below >= count_) return (static_cast<double>(bin) + 0.5) / static_cast<double>(kBins);
  }
  return kNaN;
}

void RestorationComparison::Squares::add(const EvaluatedImage& image, const cv::Mat& where) {
  const int count = cv::countNonZero(where);
  if (count == 0) return;
  sum += mean_square_error(image.truth, image.estimate, where) * count;
  pixels += static_cast<std::uint64_t>(count);
}

double RestorationComparison::Squares::psnr() const {
  return pixels == 0 ? kNaN : evaluation::psnr(sum / static_cast<double>(pixels));
}

void RestorationComparison::add(const EvaluatedImage& image) {
  const auto fits = [&](const cv::Mat& part, int type) {
    return part.empty() || (part.type() == type && part.size() == image.truth.size());
  };
  if (image.truth.empty() || image.estimate.empty() || image.hole.empty() || !fits(image.truth, CV_8UC3) ||
      !fits(image.estimate, CV_8UC3) || !fits(image.hole, CV_8UC1) || !fits(image.provenance, CV_8UC1) ||
      !fits(image.true_depth, CV_32FC1) || !fits(image.estimated_depth, CV_32FC1) ||
      !fits(image.movable, CV_8UC1))
    throw InputError(
        "truth, estimate, mask and depth of an image must be of one size and of the expected types");
  ++counts_.images;
  const cv::Mat hole = image.hole != 0;
  const int pixels = cv::countNonZero(hole);
  if (pixels < kSmallestHole) return;
  ++counts_.with_hole;
  counts_.pixels += hole.total();
  counts_.hole_pixels += static_cast<std::uint64_t>(pixels);
  psnrs_.push_back(psnr(mean_square_error(image.truth, image.estimate, hole)));
  ssims_.push_back(ssim(image.truth, image.estimate, hole));
  l1s_.push_back(mean_absolute_error(image.truth, image.estimate, hole));
  if (!image.provenance.empty()) {
    const cv::Mat inpainted = of(image, Provenance::kInpainted);
    reprojected_.add(image, of(image, Provenance::kReprojected));
    inpainted_.add(image, inpainted);
    if (!image.movable.empty()) {
      labelled_ += static_cast<std::uint64_t>(cv::countNonZero(inpainted));
      movable_ += static_cast<std::uint64_t>(cv::countNonZero(inpainted & (image.movable != 0)));
    }
  }
  if (!image.true_depth.empty() && !image.estimated_depth.empty()) add_depths(image);
  add_points(image);
}

void RestorationComparison::add_depths(const EvaluatedImage& image) {
  for (int y = 0; y < image.hole.rows; ++y) {
    for (int x = 0; x < image.hole.cols; ++x) {
      const float truth = image.true_depth.at<float>(y, x);
      if (image.hole.at<std::uint8_t>(y, x) == 0 || !(truth > 0.0F)) continue;
      ++truth_known_;
      const float estimate = image.estimated_depth.at<float>(y, x);
      if (!(estimate > 0.0F)) continue;
      ++both_known_;
      if (image.provenance.empty()) continue;
      const auto from = static_cast<Provenance>(image.provenance.at<std::uint8_t>(y, x));
      if (from == Provenance::kReprojected) depth_reprojected_.add(truth, estimate);
      if (from == Provenance::kInpainted) depth_inpainted_.add(truth, estimate);
    }
  }
}

void RestorationComparison::add_points(const EvaluatedImage& image) {
  const auto true_points = points_in_hole(extractor_, image.truth, image.hole);
  const auto points = points_in_hole(extractor_, image.estimate, image.hole);
  counts_.true_points += true_points.size();
  counts_.points += points.size();
  counts_.matched_points += static_cast<std::size_t>(std::count_if(
      true_points.begin(), true_points.end(), [&](const OrbFeature& p) { return is_found_in(p, points); }));
}

RestorationError RestorationComparison::error() const {
  RestorationError error = counts_;
  error.psnr = summarise(psnrs_).mean;
  error.ssim = summarise(ssims_).mean;
  error.l1 = summarise(l1s_).mean;
  error.reprojected_pixels = reprojected_.pixels;
  error.inpainted_pixels = inpainted_.pixels;
  error.psnr_reprojected = reprojected_.psnr();
  error.psnr_inpainted = inpainted_.psnr();
  error.depth_error_reprojected = depth_reprojected_.median();
  error.depth_error_inpainted = depth_inpainted_.median();
  error.depth_known = share(both_known_, truth_known_);
  error.movable_share = share(movable_, labelled_);
  return error;
}

}  // namespace roslam::evaluation
