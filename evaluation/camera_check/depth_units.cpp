// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/depth_units.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/upper_median.hpp"

namespace roslam::evaluation {

namespace {
double median_of(std::vector<double> values) { return values.empty() ? 0.0 : upper_median(values); }
}  // namespace

void DepthUnits::add(const FrameRun& run) {
  constexpr std::size_t kImageStep = 6;
  constexpr int kPixelStep = 4;
  constexpr double kExact = 0.02;  // units, of a value that was a whole number
  for (std::size_t i = 0; i < run.size(); i += kImageStep) {
    const cv::Mat& depth = run[i].depth;
    scale_.add(depth, fx_);
    std::vector<float> known;
    for (int y = 0; y < depth.rows; y += kPixelStep) {
      for (int x = 0; x < depth.cols; x += kPixelStep) {
        const float z = depth.at<float>(y, x);
        if (z > 0.0F && std::isfinite(z)) known.push_back(z);
      }
    }
    if (known.empty()) continue;
    std::sort(known.begin(), known.end());
    near_.push_back(known[known.size() / 20]);
    median_.push_back(known[known.size() / 2]);
    far_.push_back(known[known.size() - 1 - known.size() / 20]);
    if (units_per_metre_ <= 0.0) continue;
    for (const float z : known) {
      const double fives = z * units_per_metre_ / 5.0;
      fives_ += std::abs(fives - std::round(fives)) < kExact ? 1 : 0;
    }
    values_ += known.size();
  }
}

double DepthUnits::near() const { return median_of(near_); }
double DepthUnits::median() const { return median_of(median_); }
double DepthUnits::far() const { return median_of(far_); }

double DepthUnits::multiples_of_five() const {
  return values_ > 0 ? static_cast<double>(fives_) / static_cast<double>(values_) : 0.0;
}

std::optional<Contrast> scale_by_truth(const std::vector<TrackedPair>& pairs, const LensFit& fit) {
  constexpr double kLeastMotion = 0.02;  // metres
  constexpr std::size_t kFewest = 4;
  std::vector<double> along, squares;  // estimated along the true motion, and its square
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!fit.has_motion[i] || !pairs[i].T_to_from) continue;
    const Eigen::Vector3d truth = pairs[i].T_to_from->translation();
    if (truth.norm() < kLeastMotion) continue;
    along.push_back(
        std::log(std::max(1e-6, fit.T_to_from[i].translation().dot(truth) / truth.squaredNorm())));
  }
  if (along.size() < kFewest) return std::nullopt;
  const double middle = upper_median(along);
  std::vector<double> apart;
  for (const double value : along) apart.push_back(std::abs(value - middle));
  const double factor = std::exp(middle);
  const double sigma = 1.4826 * upper_median(apart) * std::sqrt(1.57 / static_cast<double>(along.size()));
  return Contrast{factor, factor * std::max(sigma, 1e-3)};
}

}  // namespace roslam::evaluation
