// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "roslam/common/formatted.hpp"
#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr double kInterval = 0.09;    // seconds between samples
constexpr std::size_t kHistory = 8;   // samples, 0.7 s
constexpr std::size_t kLeastLag = 2;  // samples; less may be the delay of a real sensor
constexpr std::size_t kWindow = 30;   // samples that are judged together
constexpr std::size_t kSurely = 24;   // samples after which none of the alternatives is expected to fit
constexpr std::size_t kFrames = 90;   // the window of tracking
constexpr std::size_t kLeastSamples = 12;
constexpr double kFewestKnown = 0.1;  // share of the image whose depth must be known
constexpr std::size_t kFlips = 3;
constexpr std::array<const char*, kFlips> kFlipNames{"mirrored left to right", "mirrored upside down",
                                                     "turned by 180 degrees"};

cv::Size small_size(const cv::Mat& image) {
  constexpr int kWidth = 160;
  return {kWidth, std::max(1, image.rows * kWidth / std::max(image.cols, 1))};
}

// CV_8UC1: 255 * share of the pixels whose gradient is smaller; the largest within a pixel, as depth is
// registered to no better than that.
cv::Mat gradient_rank(const cv::Mat& small) {
  cv::Mat dx, dy, gradient;
  cv::Sobel(small, dx, CV_32F, 1, 0);
  cv::Sobel(small, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, gradient);
  cv::dilate(gradient, gradient, cv::Mat::ones(3, 3, CV_8U));
  constexpr int kBins = 1024;
  constexpr float kLargest = 1450.0F;  // of a Sobel filter on 8 bits
  std::vector<int> lower(kBins + 1, 0);
  const auto bin = [](float value) {
    return static_cast<std::size_t>(std::clamp(value / kLargest * kBins, 0.0F, kBins - 1.0F));
  };
  for (auto it = gradient.begin<float>(); it != gradient.end<float>(); ++it) ++lower[bin(*it) + 1];
  for (std::size_t i = 1; i < lower.size(); ++i) lower[i] += lower[i - 1];
  cv::Mat rank(small.size(), CV_8UC1);
  for (int y = 0; y < rank.rows; ++y) {
    for (int x = 0; x < rank.cols; ++x) {
      const std::size_t b = bin(gradient.at<float>(y, x));
      rank.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(127.5 * (lower[b] + lower[b + 1]) /
                                                                    static_cast<double>(rank.total()));
    }
  }
  return rank;
}

bool is_known(float depth) { return std::isfinite(depth) && depth > 0.0F; }

// Pixels on the near side of a step in depth, along rows and columns; a few unknown pixels between are a
// shadow.
std::vector<cv::Point> depth_edges(const cv::Mat& small) {
  constexpr int kLargestGap = 4;  // pixels from one known to the next
  constexpr float kStep = 1.15F;  // ratio of depths
  std::vector<cv::Point> edges;
  const auto scan = [&](int lines, int length, const auto& pixel) {
    for (int line = 0; line < lines; ++line) {
      int last = -kLargestGap - 1;
      for (int i = 0; i < length; ++i) {
        const float depth = small.at<float>(pixel(line, i));
        if (!is_known(depth)) continue;
        if (i - last <= kLargestGap) {
          const float before = small.at<float>(pixel(line, last));
          if (depth > kStep * before) edges.push_back(pixel(line, last));
          if (before > kStep * depth) edges.push_back(pixel(line, i));
        }
        last = i;
      }
    }
  };
  scan(small.rows, small.cols, [](int line, int i) { return cv::Point(i, line); });
  scan(small.cols, small.rows, [](int line, int i) { return cv::Point(line, i); });
  return edges;
}

double mean_rank(const cv::Mat& rank, const std::vector<cv::Point>& edges, bool flips_x = false,
                 bool flips_y = false) {
  double sum = 0.0;
  for (const cv::Point& edge : edges) {
    sum += rank.at<std::uint8_t>(flips_y ? rank.rows - 1 - edge.y : edge.y,
                                 flips_x ? rank.cols - 1 - edge.x : edge.x);
  }
  return sum / (255.0 * static_cast<double>(edges.size()));
}

template <typename Value>
void push(std::deque<Value>& values, Value value, std::size_t most) {
  values.push_back(std::move(value));
  if (values.size() > most) values.pop_front();
}

double median_of(const std::deque<double>& values) {
  std::vector<double> copy(values.begin(), values.end());
  return upper_median(copy);
}
}  // namespace

void DepthCheck::restart_clock() {
  history_.clear();
  verdicts_.clear();
  last_timestamp_.reset();
}

void DepthCheck::add(const cv::Mat& grey, const cv::Mat& depth, double timestamp) {
  constexpr double kLongestGap = 2.0;  // seconds
  if (depth.empty() || (last_timestamp_ && timestamp - *last_timestamp_ < kInterval)) return;
  if (last_timestamp_ && timestamp - *last_timestamp_ > kLongestGap) restart_clock();
  last_timestamp_ = timestamp;
  cv::Mat small_grey;
  cv::Mat small_depth;
  cv::resize(grey, small_grey, small_size(grey), 0, 0, cv::INTER_AREA);
  cv::resize(depth, small_depth, small_grey.size(), 0, 0, cv::INTER_NEAREST);
  history_.push_back({timestamp, gradient_rank(small_grey), depth_edges(small_depth)});
  if (history_.size() > kHistory) history_.pop_front();
  // Samples of a camera at rest show the same again and are no further evidence.
  constexpr double kMoved = 1.5;  // grey values, mean difference
  const bool has_moved =
      last_grey_.size() != small_grey.size() ||
      cv::norm(small_grey, last_grey_, cv::NORM_L1) > kMoved * static_cast<double>(small_grey.total());
  if (!has_moved) return;
  last_grey_ = small_grey;
  const DepthSpread spread = spread_of(small_depth);
  check_frozen(spread, small_depth);
  check_scale(spread, depth);
  if (auto verdict = compare(history_.back())) {
    push(verdicts_, std::move(*verdict), kWindow);
    judge();
  }
}

void DepthCheck::note_tracking(bool is_tracked, bool is_keyframe) {
  push(troubles_, !is_tracked || is_keyframe, kFrames);
}

DepthCheck::DepthSpread DepthCheck::spread_of(const cv::Mat& depth) {
  std::vector<float> known;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (is_known(depth.at<float>(y, x))) known.push_back(depth.at<float>(y, x));
    }
  }
  if (known.empty()) return {};
  const auto percentile = [&](double share) {
    const auto at =
        known.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(known.size() - 1));
    std::nth_element(known.begin(), at, known.end());
    return static_cast<double>(*at);
  };
  return {static_cast<double>(known.size()) / static_cast<double>(depth.total()), percentile(0.05),
          percentile(0.5), percentile(0.95)};
}

void DepthCheck::check_frozen(const DepthSpread& spread, const cv::Mat& small) {
  constexpr int kSamples = 10;        // in a row
  constexpr double kConstant = 1e-3;  // of the depth
  const bool is_same = spread.known > kFewestKnown && last_depth_.size() == small.size() &&
                       cv::norm(small, last_depth_, cv::NORM_INF) == 0.0;
  const bool is_constant =
      spread.known > kFewestKnown && spread.far - spread.near < kConstant * spread.median;
  last_depth_ = small;
  frozen_ = is_same ? frozen_ + 1 : 0;
  constant_ = is_constant ? constant_ + 1 : 0;
  if (constant_ >= kSamples)
    raise("the depth is the same all over the image; check the depth images", is_misfit_);
  else if (frozen_ >= kSamples)
    raise("the depth image does not change while the colour image does; check the depth stream", is_misfit_);
}

void DepthCheck::check_scale(const DepthSpread& spread, const cv::Mat& depth) {
  constexpr double kNear = 0.6;         // metres; 95 % of a depth image within it,
  constexpr double kMedianNear = 0.25;  // or half of it within this, is nearer than depth sensors measure
  constexpr double kFar = 15.0;         // metres; of farther scenes stereo of any baseline may be right
  constexpr std::size_t kEvery = 2;     // samples
  if (spread.known < kFewestKnown) return;
  push(far_, spread.far, kWindow);
  push(medians_, spread.median, kWindow);
  if (samples_++ % kEvery == 0 && !is_large_) {
    scale_.add(depth, fx_);
    const auto baseline = scale_.implausible_baseline();
    if (baseline && median_of(far_) < kFar)
      raise(formatted("depth is implausibly large: its steps and shadows are those of a baseline of %.2f m; "
                      "depth_units_per_metre is probably too small",
                      *baseline),
            is_large_);
  }
  if (far_.size() < kLeastSamples + kHistory) return;
  if (median_of(far_) > kNear && median_of(medians_) > kMedianNear) return;
  raise(formatted("depth is implausibly small: 95 %% of the image within %.2f m, half within %.2f m; "
                  "depth_units_per_metre is probably too large",
                  median_of(far_), median_of(medians_)),
        is_small_);
}

std::optional<DepthCheck::Verdict> DepthCheck::compare(const Sample& sample) const {
  constexpr std::size_t kFewestEdges = 40;
  if (sample.edges.size() < kFewestEdges) return std::nullopt;
  Verdict verdict;
  verdict.registered = mean_rank(sample.gradient_rank, sample.edges);
  verdict.advantages.assign(kFlips + 2 * kHistory, std::nan(""));
  const auto set = [&](std::size_t i, double score) { verdict.advantages[i] = score - verdict.registered; };
  set(0, mean_rank(sample.gradient_rank, sample.edges, true, false));
  set(1, mean_rank(sample.gradient_rank, sample.edges, false, true));
  set(2, mean_rank(sample.gradient_rank, sample.edges, true, true));
  for (std::size_t lag = kLeastLag; lag < history_.size(); ++lag) {
    const Sample& past = history_[history_.size() - 1 - lag];
    if (past.gradient_rank.size() != sample.gradient_rank.size()) continue;
    set(kFlips + lag, mean_rank(past.gradient_rank, sample.edges));
    if (past.edges.size() >= kFewestEdges)
      set(kFlips + kHistory + lag, mean_rank(sample.gradient_rank, past.edges));
  }
  return verdict;
}

// Of the alternatives that fit as well as registered images do, the one that fits best.
DepthCheck::Alternative DepthCheck::best_alternative() const {
  constexpr double kAdvantage = 0.07;
  constexpr double kCertainty = 5.0;  // mean over its standard error
  constexpr double kFits = 0.63;
  Alternative best;
  for (std::size_t i = 0; i < verdicts_.back().advantages.size(); ++i) {
    double sum = 0.0;
    double squares = 0.0;
    double registered = 0.0;
    double count = 0.0;
    for (const auto& verdict : verdicts_) {
      const double a = verdict.advantages[i];
      if (!std::isfinite(a)) continue;
      sum += a;
      squares += a * a;
      registered += verdict.registered;
      ++count;
    }
    if (count < static_cast<double>(kLeastSamples)) continue;
    const double mean = sum / count;
    const double error = std::sqrt(std::max(squares / count - mean * mean, 0.0) / count);
    if (mean > std::max({kAdvantage, kCertainty * error, best.advantage}) &&
        mean + registered / count > kFits)
      best = {i, mean};
  }
  return best;
}

void DepthCheck::judge() {
  if (verdicts_.size() < kLeastSamples + kHistory || is_misfit_)
    return;  // all alternatives are known by then
  const Alternative best = best_alternative();
  if (best.advantage > 0.0 && best.index < kFlips) {
    raise(std::string("the depth images are ") + kFlipNames[best.index] + " against the colour images",
          is_misfit_);
  } else if (best.advantage > 0.0) {
    const std::size_t lag = (best.index - kFlips) % kHistory;
    const double seconds = history_.back().timestamp - history_[history_.size() - 1 - lag].timestamp;
    const char* kind = best.index < kFlips + kHistory
                           ? "the depth images lag behind the colour images by about %.1f s"
                           : "the depth images are ahead of the colour images by about %.1f s";
    raise(formatted(kind, seconds), is_misfit_);
  } else if (verdicts_.size() >= kSurely) {
    constexpr double kUnrelated = 0.6;
    constexpr double kTrouble = 0.25;  // share of frames lost or made keyframes
    double registered = 0.0;
    for (const auto& verdict : verdicts_) registered += verdict.registered;
    registered /= static_cast<double>(verdicts_.size());
    const auto troubles = static_cast<double>(std::count(troubles_.begin(), troubles_.end(), true));
    if (registered < kUnrelated && troubles >= kTrouble * static_cast<double>(troubles_.size()))
      raise("the depth images do not belong to the colour images: their edges do not coincide", is_misfit_);
  }
}

void DepthCheck::raise(const std::string& alarm, bool& is_raised) {
  if (!is_raised) alarms_.push_back(alarm);
  is_raised = true;
}

}  // namespace roslam
