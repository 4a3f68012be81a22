// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/evaluation/restoration_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "roslam/error.hpp"
#include "roslam/evaluation/picture_error.hpp"
#include "roslam/evaluation/statistics.hpp"

namespace roslam {

namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kSmallestHole = 100;   // pixels
constexpr float kSamePlace = 3.0F;   // pixels between a point and itself
constexpr int kSameDescriptor = 64;  // bits

double share(std::uint64_t part, std::uint64_t all) {
  return all == 0 ? kNaN : static_cast<double>(part) / static_cast<double>(all);
}

cv::Mat of(const RestoredPicture& picture, Provenance provenance) {
  return (picture.provenance == static_cast<double>(provenance)) & (picture.hole != 0);
}

std::vector<OrbFeature> points_in_hole(const OrbExtractor& extractor, const cv::Mat& picture,
                                       const cv::Mat& hole) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  auto points = extractor.extract(grey);
  std::erase_if(points, [&](const OrbFeature& point) {
    return hole.at<std::uint8_t>(std::min(cvRound(point.pixel.y), hole.rows - 1),
                                 std::min(cvRound(point.pixel.x), hole.cols - 1)) == 0;
  });
  return points;
}

bool is_found_in(const OrbFeature& point, const std::vector<OrbFeature>& others) {
  return std::any_of(others.begin(), others.end(), [&](const OrbFeature& other) {
    return std::abs(point.pixel.x - other.pixel.x) <= kSamePlace &&
           std::abs(point.pixel.y - other.pixel.y) <= kSamePlace &&
           hamming(point.descriptor, other.descriptor) <= kSameDescriptor;
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

void RestorationComparison::Squares::add(const RestoredPicture& picture, const cv::Mat& where) {
  const int count = cv::countNonZero(where);
  if (count == 0) return;
  sum += mean_square_error(picture.truth, picture.estimate, where) * count;
  pixels += static_cast<std::uint64_t>(count);
}

double RestorationComparison::Squares::psnr() const {
  return pixels == 0 ? kNaN : roslam::psnr(sum / static_cast<double>(pixels));
}

void RestorationComparison::add(const RestoredPicture& picture) {
  const auto fits = [&](const cv::Mat& image, int type) {
    return image.empty() || (image.type() == type && image.size() == picture.truth.size());
  };
  if (picture.truth.empty() || picture.estimate.empty() || picture.hole.empty() ||
      !fits(picture.truth, CV_8UC3) || !fits(picture.estimate, CV_8UC3) || !fits(picture.hole, CV_8UC1) ||
      !fits(picture.provenance, CV_8UC1) || !fits(picture.true_depth, CV_32FC1) ||
      !fits(picture.estimated_depth, CV_32FC1) || !fits(picture.movable, CV_8UC1))
    throw InputError("truth, estimate, mask and depth of a picture must be of one size");
  ++counts_.pictures;
  const cv::Mat hole = picture.hole != 0;
  const int pixels = cv::countNonZero(hole);
  if (pixels < kSmallestHole) return;
  ++counts_.with_hole;
  counts_.pixels += hole.total();
  counts_.hole_pixels += static_cast<std::uint64_t>(pixels);
  psnrs_.push_back(psnr(mean_square_error(picture.truth, picture.estimate, hole)));
  ssims_.push_back(ssim(picture.truth, picture.estimate, hole));
  l1s_.push_back(mean_absolute_error(picture.truth, picture.estimate, hole));
  if (!picture.provenance.empty()) {
    const cv::Mat invented = of(picture, Provenance::kInvented);
    reprojected_.add(picture, of(picture, Provenance::kReprojected));
    invented_.add(picture, invented);
    if (!picture.movable.empty()) {
      labelled_ += static_cast<std::uint64_t>(cv::countNonZero(invented));
      movable_ += static_cast<std::uint64_t>(cv::countNonZero(invented & (picture.movable != 0)));
    }
  }
  if (!picture.true_depth.empty() && !picture.estimated_depth.empty()) add_depths(picture);
  add_points(picture);
}

void RestorationComparison::add_depths(const RestoredPicture& picture) {
  for (int y = 0; y < picture.hole.rows; ++y) {
    for (int x = 0; x < picture.hole.cols; ++x) {
      const float truth = picture.true_depth.at<float>(y, x);
      if (picture.hole.at<std::uint8_t>(y, x) == 0 || !(truth > 0.0F)) continue;
      ++truth_known_;
      const float estimate = picture.estimated_depth.at<float>(y, x);
      if (!(estimate > 0.0F)) continue;
      ++both_known_;
      if (picture.provenance.empty()) continue;
      const auto from = static_cast<Provenance>(picture.provenance.at<std::uint8_t>(y, x));
      if (from == Provenance::kReprojected) depth_reprojected_.add(truth, estimate);
      if (from == Provenance::kInvented) depth_invented_.add(truth, estimate);
    }
  }
}

void RestorationComparison::add_points(const RestoredPicture& picture) {
  const auto true_points = points_in_hole(extractor_, picture.truth, picture.hole);
  const auto points = points_in_hole(extractor_, picture.estimate, picture.hole);
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
  error.invented_pixels = invented_.pixels;
  error.psnr_reprojected = reprojected_.psnr();
  error.psnr_invented = invented_.psnr();
  error.depth_error_reprojected = depth_reprojected_.median();
  error.depth_error_invented = depth_invented_.median();
  error.depth_known = share(both_known_, truth_known_);
  error.movable_share = share(movable_, labelled_);
  return error;
}

}  // namespace roslam
