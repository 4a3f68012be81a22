// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/stereo_matcher.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "roslam/common/error.hpp"
#include "roslam/common/target_clones.hpp"

namespace roslam {

namespace {
constexpr int kRadius = 5;  // pixels of a level
constexpr int kSide = 2 * kRadius + 1;
constexpr int kArea = kSide * kSide;
// Pixels beyond the least disparity: neighbours of a far point, and cubic interpolation.
constexpr int kMargin = 2;
constexpr float kFlat = 4.0F * kArea;  // a variance of four grey levels: what sensor noise alone has

using Patch = std::array<float, kArea>;

// Mean of zero; returns the sum of squares.
float centre(Patch& patch) {
  float sum = 0.0F, squares = 0.0F;
  for (const float value : patch) sum += value;
  for (float& value : patch) {
    value -= sum / kArea;
    squares += value * value;
  }
  return squares;
}

// Rows of an image around a row as numbers: kSide rows of so many columns, from a column on.
struct Strip {
  std::vector<float> values;
  int begin = 0, columns = 0;

  bool read(const cv::Mat& image, int y, int from, int to) {
    begin = std::max(from, 0);
    columns = std::min(to, image.cols) - begin;
    if (columns < kSide) return false;
    values.resize(static_cast<std::size_t>(kSide * columns));
    for (int r = 0; r < kSide; ++r) {
      const std::uint8_t* pixels = image.ptr(y + r - kRadius) + begin;
      std::copy(pixels, pixels + columns, row(r));
    }
    return true;
  }
  float* row(int r) { return values.data() + static_cast<std::ptrdiff_t>(r) * columns; }
  const float* row(int r) const { return values.data() + static_cast<std::ptrdiff_t>(r) * columns; }
  int places() const { return columns - kSide + 1; }

  Patch at(int place) const {
    Patch patch;
    for (int r = 0; r < kSide; ++r) std::copy_n(row(r) + place, kSide, patch.begin() + r * kSide);
    return patch;
  }
};

// Adds to sums, for each place, the product of a row of the patch with the row of the strip there.
ROSLAM_TARGET_CLONES("avx2")
void add_products(const float* patch_row, const float* strip_row, float* sums, int places) {
  for (int i = 0; i < places; ++i) {
    float sum = sums[i];
    for (int k = 0; k < kSide; ++k) sum += patch_row[k] * strip_row[i + k];
    sums[i] = sum;
  }
}

// Adds the values of a row and their squares to those of its columns.
ROSLAM_TARGET_CLONES("avx2")
void add_columns(const float* row, float* sums, float* squares, int columns) {
  for (int i = 0; i < columns; ++i) {
    sums[i] += row[i];
    squares[i] += row[i] * row[i];
  }
}

// Divides products by the norms of the patches at their places. squares: of the patch that is searched for.
ROSLAM_TARGET_CLONES("avx2")
void normalise(const float* sums, const float* all_squares, float squares, float* values, int places) {
  for (int i = 0; i < places; ++i) {
    float sum = 0.0F, square = 0.0F;
    for (int k = 0; k < kSide; ++k) {
      sum += sums[i + k];
      square += all_squares[i + k];
    }
    const float variance = square - sum * sum / kArea;
    values[i] = variance > kFlat ? values[i] / std::sqrt(variance * squares) : 0.0F;
  }
}

// The correlation of a patch with all places of a strip.
class Correlation {
 public:
  // patch: of zero mean and that sum of squares.
  void compute(const Patch& patch, float squares, const Strip& strip) {
    const int places = strip.places();
    values_.assign(static_cast<std::size_t>(places), 0.0F);
    sums_.assign(static_cast<std::size_t>(strip.columns), 0.0F);
    squares_.assign(static_cast<std::size_t>(strip.columns), 0.0F);
    for (int r = 0; r < kSide; ++r) {
      add_products(patch.data() + static_cast<std::ptrdiff_t>(r) * kSide, strip.row(r), values_.data(),
                   places);
      add_columns(strip.row(r), sums_.data(), squares_.data(), strip.columns);
    }
    normalise(sums_.data(), squares_.data(), squares, values_.data(), places);
  }

  int best() const {
    return static_cast<int>(std::max_element(values_.begin(), values_.end()) - values_.begin());
  }
  float at(int place) const { return values_[static_cast<std::size_t>(place)]; }

  // The best of the places that are not beside this one.
  float best_apart_from(int place) const {
    constexpr int kBeside = 2;
    float best = 0.0F;
    for (int i = 0; i < static_cast<int>(values_.size()); ++i)
      if (std::abs(i - place) > kBeside) best = std::max(best, at(i));
    return best;
  }

 private:
  std::vector<float> values_, sums_, squares_;
};

// The values of a strip between its columns, and their derivatives: cubic convolution (Keys 1981).
void interpolate(const Strip& strip, int place, float fraction, Patch& values, Patch& slopes) {
  const float t = fraction, t2 = t * t, t3 = t2 * t;
  const std::array<float, 4> w{0.5F * (-t3 + 2 * t2 - t), 0.5F * (3 * t3 - 5 * t2 + 2),
                               0.5F * (-3 * t3 + 4 * t2 + t), 0.5F * (t3 - t2)};
  const std::array<float, 4> d{0.5F * (-3 * t2 + 4 * t - 1), 0.5F * (9 * t2 - 10 * t),
                               0.5F * (-9 * t2 + 8 * t + 1), 0.5F * (3 * t2 - 2 * t)};
  for (int r = 0; r < kSide; ++r) {
    const float* row = strip.row(r) + place - 1;
    for (int k = 0; k < kSide; ++k) {
      const auto i = static_cast<std::size_t>(r * kSide + k);
      values[i] = w[0] * row[k] + w[1] * row[k + 1] + w[2] * row[k + 2] + w[3] * row[k + 3];
      slopes[i] = d[0] * row[k] + d[1] * row[k + 1] + d[2] * row[k + 2] + d[3] * row[k + 3];
    }
  }
}

struct Fit {
  float place = 0.0F;
  float sigma = 0.0F;
};

// Where in the strip the patch (zero mean, that sum of squares) is, near a place.
std::optional<Fit> refine(const Patch& patch, float squares, const Strip& strip, int place) {
  constexpr int kIterations = 5;
  constexpr float kConverged = 0.01F, kFarthest = 1.0F;  // pixels
  Patch values{}, slopes{};
  float shift = 0.0F, step = 1.0F, information = 0.0F, residual = 0.0F;
  for (int i = 0; i < kIterations && std::abs(step) > kConverged; ++i) {
    const float whole = std::floor(shift);
    const int at = place + static_cast<int>(whole);
    if (at < 1 || at + kSide + 2 > strip.columns) return std::nullopt;
    interpolate(strip, at, shift - whole, values, slopes);
    const float variance = centre(values);
    centre(slopes);
    if (variance < kFlat) return std::nullopt;
    const float gain = std::sqrt(squares / variance);
    information = residual = 0.0F;
    float gradient = 0.0F;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const float slope = gain * slopes[k], error = patch[k] - gain * values[k];
      information += slope * slope;
      gradient += slope * error;
      residual += error * error;
    }
    if (!(information > 0.0F)) return std::nullopt;
    step = std::clamp(gradient / information, -0.5F, 0.5F);
    shift += step;
    if (std::abs(shift) > kFarthest) return std::nullopt;
  }
  if (std::abs(step) > 10.0F * kConverged) return std::nullopt;  // on a ridge
  return Fit{static_cast<float>(place) + shift, std::sqrt(residual / (kArea - 3) / information)};
}

// Searches the patches of a level.
class LevelSearch {
 public:
  LevelSearch(const cv::Mat& left, const cv::Mat& right, int most, const StereoOptions& options)
      : left_(left), right_(right), most_(most), options_(options) {}

  // In pixels of the level.
  std::optional<Disparity> find(const cv::Point& pixel) {
    const auto [x, y] = pixel;
    if (x < kRadius || y < kRadius || x + kRadius >= left_.cols || y + kRadius >= left_.rows) return {};
    if (!own_.read(left_, y, x - kRadius, x + kRadius + 1)) return {};
    Patch patch = own_.at(0);
    const float squares = centre(patch);
    if (squares < kFlat) return {};
    // A place is that of the patch's left column.
    if (!strip_.read(right_, y, x - kRadius - most_ - kMargin, x + kRadius + kMargin + 1)) return {};
    correlation_.compute(patch, squares, strip_);
    const int best = correlation_.best();
    const auto least = static_cast<float>(options_.min_correlation);
    const float correlation = correlation_.at(best);
    if (correlation < least) return {};
    if (correlation_.best_apart_from(best) > static_cast<float>(options_.uniqueness) * correlation) return {};
    if (!leads_back(pixel, best)) return {};
    const auto fit = refine(patch, squares, strip_, best);
    if (!fit) return {};
    return Disparity{static_cast<float>(x - kRadius - strip_.begin) - fit->place, fit->sigma};
  }

 private:
  bool leads_back(const cv::Point& pixel, int place) {
    Patch found = strip_.at(place);
    const float squares = centre(found);
    const int x = strip_.begin + place;
    if (squares < kFlat || !back_.read(left_, pixel.y, x - kMargin, x + most_ + kSide + kMargin))
      return false;
    back_correlation_.compute(found, squares, back_);
    return std::abs(back_.begin + back_correlation_.best() - (pixel.x - kRadius)) <= 1;
  }

  const cv::Mat& left_;
  const cv::Mat& right_;
  int most_;  // pixels of the level
  const StereoOptions& options_;
  Strip own_, strip_, back_;
  Correlation correlation_, back_correlation_;
};
}  // namespace

StereoMatcher::StereoMatcher(const Camera& camera, const StereoOptions& options)
    : focal_baseline_(camera.fx * camera.baseline), options_(options) {
  options_.validate();
  if (!camera.is_stereo()) throw CalibrationError("camera calibration: baseline is not set");
}

std::vector<std::optional<Disparity>> StereoMatcher::match(std::span<const OrbFeature> features,
                                                           const std::vector<cv::Mat>& left,
                                                           const std::vector<cv::Mat>& right) const {
  std::vector<std::optional<Disparity>> result(features.size());
  if (left.empty() || right.empty() || left.front().size() != right.front().size()) return result;
  const double most = std::min(focal_baseline_ / options_.min_depth, 0.5 * left.front().cols);
  std::vector<LevelSearch> searches;
  std::vector<cv::Point2f> scales;  // pixels of the full image of one of the level
  for (std::size_t level = 0; level < left.size(); ++level) {
    scales.emplace_back(static_cast<float>(left.front().cols) / static_cast<float>(left[level].cols),
                        static_cast<float>(left.front().rows) / static_cast<float>(left[level].rows));
    searches.emplace_back(left[level], right[level], static_cast<int>(std::ceil(most / scales.back().x)),
                          options_);
  }
  const auto floor = static_cast<float>(options_.disparity_sigma);
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto level = static_cast<std::size_t>(features[i].level);
    const cv::Point2f& scale = scales[level];
    const cv::Point at(cvRound((features[i].pixel.x + 0.5F) / scale.x - 0.5F),
                       cvRound((features[i].pixel.y + 0.5F) / scale.y - 0.5F));
    result[i] = searches[level].find(at);
    if (!result[i]) continue;
    result[i]->pixels *= scale.x;
    result[i]->sigma = scale.x * std::hypot(result[i]->sigma, floor);
  }
  return result;
}

void StereoMatcher::set_depths(const std::vector<std::optional<Disparity>>& disparities,
                               ObservedFrame& view) const {
  constexpr float kLeast = 0.1F;  // pixels; the depth of less is not known at all
  view.depths.assign(view.size(), 0.0F);
  view.inverse_depth_sigmas.assign(view.size(), 0.0F);
  for (std::size_t i = 0; i < disparities.size() && i < view.size(); ++i) {
    if (!disparities[i] || disparities[i]->pixels < kLeast) continue;
    view.depths[i] = static_cast<float>(focal_baseline_ / disparities[i]->pixels);
    view.inverse_depth_sigmas[i] = static_cast<float>(disparities[i]->sigma / focal_baseline_);
  }
}

}  // namespace roslam
