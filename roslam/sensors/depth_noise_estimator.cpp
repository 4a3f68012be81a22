// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_noise_estimator.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr int kStep = 10;               // pixels between points that are compared
constexpr double kInterval = 0.1;       // seconds between compared images: consecutive ones share some noise
constexpr double kLongest = 0.5;        // seconds, as the view and the error of the poses change
constexpr double kEnough = 2000;        // samples of a band
constexpr double kEnoughInAll = 20000;  // samples
constexpr double kKept = 200000;        // samples of a band; older ones fade

// Bands of depth and bins of errors are of equal ratio.
constexpr double kNearest = 0.25;  // metres
constexpr double kBandRatio = 1.5;
constexpr double kSmallest = 1e-4;  // 1/metre
constexpr double kBinRatio = 1.12;

struct Weighted {
  double value;
  double weight;
};

double weighted_median(std::vector<Weighted> values) {
  std::sort(values.begin(), values.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  double all = 0.0;
  for (const Weighted& value : values) all += value.weight;
  double below = 0.0;
  for (const Weighted& value : values) {
    below += value.weight;
    if (2.0 * below >= all) return value.value;
  }
  return values.back().value;
}

// The depth at a pixel on a smooth surface, else 0.
float smooth_depth(const cv::Mat& depth, const cv::Point& pixel) {
  constexpr int kReach = 3;              // pixels
  constexpr float kLargestStep = 0.15F;  // share of the depth
  if (!cv::Rect(kReach, kReach, depth.cols - 2 * kReach, depth.rows - 2 * kReach).contains(pixel))
    return 0.0F;
  const float z = depth.at<float>(pixel);
  if (!(z > 0.0F)) return 0.0F;
  for (const cv::Point& offset :
       {cv::Point(-kReach, 0), cv::Point(kReach, 0), cv::Point(0, -kReach), cv::Point(0, kReach)}) {
    if (!(std::abs(depth.at<float>(pixel + offset) - z) <= kLargestStep * z)) return 0.0F;
  }
  return z;
}
}  // namespace

DepthNoiseEstimator::DepthNoiseEstimator(const Camera& camera) : camera_(camera) {
  for (int y = kStep / 2; y < camera.height; y += kStep) {
    for (int x = kStep / 2; x < camera.width; x += kStep) {
      const auto undistorted = camera.try_undistort(Eigen::Vector2d(x, y));
      if (!undistorted) continue;
      grid_.push_back({camera.unproject(*undistorted, 1.0).cast<float>(), {x, y}});
    }
  }
}

void DepthNoiseEstimator::add(const cv::Mat& depth, const cv::Mat& excluded, const SE3& T_camera_world,
                              double timestamp) {
  constexpr double kRounding = 0.01;  // seconds
  const double elapsed = reference_ ? timestamp - reference_->timestamp : kInterval;
  if (depth.empty() || (elapsed >= 0.0 && elapsed < kInterval - kRounding)) return;
  if (reference_ && elapsed > 0.0 && elapsed <= kLongest) compare(depth, excluded, T_camera_world);
  reference_ = Reference{timestamp, T_camera_world, {}};
  for (const Point& point : grid_) {
    if (!excluded.empty() && excluded.at<std::uint8_t>(point.pixel) != 0) continue;
    const float z = smooth_depth(depth, point.pixel);
    if (z > 0.0F) reference_->points.push_back(z * point.ray);
  }
}

void DepthNoiseEstimator::compare(const cv::Mat& depth, const cv::Mat& excluded, const SE3& T_camera_world) {
  const SE3 T_now_before = T_camera_world * reference_->T_camera_world.inverse();
  for (const Eigen::Vector3f& before : reference_->points) {
    const Eigen::Vector3d point = T_now_before * before.cast<double>();
    if (point.z() <= kNearest) continue;
    const Eigen::Vector2d at = camera_.distort(camera_.project(point));
    if (!(at.x() >= 0.0 && at.y() >= 0.0 && at.x() < camera_.width - 1 && at.y() < camera_.height - 1))
      continue;
    const cv::Point pixel(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
    if (!excluded.empty() && excluded.at<std::uint8_t>(pixel) != 0) continue;
    const double z = smooth_depth(depth, pixel);
    if (z <= 0.0) continue;
    const auto band = static_cast<std::size_t>(std::log(point.z() / kNearest) / std::log(kBandRatio));
    if (band >= kBands) continue;
    const double error = std::abs(1.0 / z - 1.0 / point.z());
    const double bin = std::log(std::max(error, kSmallest) / kSmallest) / std::log(kBinRatio);
    Histogram& histogram = histograms_[band];
    histogram.count[std::min(static_cast<std::size_t>(bin), kBins - 1)] += 1.0;
    histogram.samples += 1.0;
    histogram.depth += point.z();
  }
  for (Histogram& histogram : histograms_) {
    if (histogram.samples <= kKept) continue;
    for (double& count : histogram.count) count *= 0.5;
    histogram.samples *= 0.5;
    histogram.depth *= 0.5;
  }
}

std::vector<DepthNoiseEstimator::Band> DepthNoiseEstimator::bands() const {
  // Sigma of the noise of one image in medians of the absolute difference of two.
  constexpr double kSigmaOfMedian = 1.4826 / 1.4142;
  std::vector<Band> result;
  for (const Histogram& histogram : histograms_) {
    if (histogram.samples < kEnough) continue;
    std::size_t bin = 0;
    double below = 0.0;
    while (2.0 * (below + histogram.count[bin]) < histogram.samples) below += histogram.count[bin++];
    const double share = (0.5 * histogram.samples - below) / histogram.count[bin];
    const double median = kSmallest * std::pow(kBinRatio, static_cast<double>(bin) + share);
    const double depth = histogram.depth / histogram.samples;
    result.push_back(
        {depth, kSigmaOfMedian * median * depth * depth, static_cast<std::size_t>(histogram.samples)});
  }
  return result;
}

// Medians over the bands, by their samples, so that a band that shows little but a moving thing does not
// matter: of sigma / depth² where the constant part counts little, then of what is left of sigma where it is
// near.
std::optional<DepthNoise> DepthNoiseEstimator::estimate() const {
  constexpr double kNear = 1.0;      // metres
  constexpr double kLeast = 0.0005;  // metres; 1/metre: no camera is better
  constexpr double kMost = 0.05;
  const std::vector<Band> all = bands();
  double samples = 0.0;
  for (const Band& band : all) samples += static_cast<double>(band.samples);
  if (samples < kEnoughInAll) return std::nullopt;
  std::vector<Weighted> growths;
  const bool is_all_near = all.back().depth < kNear;
  for (const Band& band : all) {
    if (is_all_near || band.depth >= kNear)
      growths.push_back({band.sigma / (band.depth * band.depth), static_cast<double>(band.samples)});
  }
  const double growth = std::clamp(weighted_median(growths), kLeast, kMost);
  std::vector<Weighted> constants;
  for (const Band& band : all) {
    if (band.depth < kNear)
      constants.push_back({band.sigma - growth * band.depth * band.depth, static_cast<double>(band.samples)});
  }
  const double constant = constants.empty() ? kLeast : weighted_median(constants);
  return DepthNoise{std::clamp(constant, kLeast, kMost), growth};
}

}  // namespace roslam
