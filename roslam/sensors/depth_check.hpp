// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/sensors/depth_scale.hpp"

namespace roslam {

/// Checks during a flight that the depth images belong to the colour images they come with and are of a
/// plausible scale. Edges of depth lie on edges of the image: the share of the image that has less gradient
/// than the depth edges have is about 0.75 for registered images and 0.5 for unrelated ones. Where depth that
/// is mirrored, turned, or of another time fits better than the one given, that is the fault; where none fits
/// and tracking fails, the images do not belong together. A wrong scale shows in depth that no sensor
/// measures. Ten images a second are looked at, while the view changes. Not thread safe.
class DepthCheck {
 public:
  /// fx: of the camera, pixels.
  explicit DepthCheck(double fx) : fx_(fx) {}

  /// grey: CV_8UC1; depth: CV_32FC1 of its size, metres, may be empty; timestamp: seconds, ascending.
  void add(const cv::Mat& grey, const cv::Mat& depth, double timestamp);

  /// What became of the frame last added.
  void note_tracking(bool is_tracked, bool is_keyframe);

  /// To be called when the source's clock was reset.
  void restart_clock();

  /// Faults that were found, with cause and remedy, each once, in the order of time.
  const std::vector<std::string>& alarms() const { return alarms_; }

 private:
  struct Sample {
    double timestamp = 0.0;
    cv::Mat gradient_rank;         // CV_8UC1, 255 * share of the image with a lower gradient
    std::vector<cv::Point> edges;  // of depth
  };
  struct DepthSpread {
    double known = 0.0;  // share of the image
    double near = 0.0;   // metres; percentiles 5, 50 and 95 of what is known
    double median = 0.0;
    double far = 0.0;
  };
  struct Verdict {
    double registered = 0.0;         // mean rank of the gradient at depth edges, 0 to 1
    std::vector<double> advantages;  // of each alternative over it
  };

  void check_scale(const DepthSpread& spread, const cv::Mat& depth);
  void check_frozen(const DepthSpread& spread, const cv::Mat& small);
  static DepthSpread spread_of(const cv::Mat& depth);
  std::optional<Verdict> compare(const Sample& sample) const;
  struct Alternative {
    std::size_t index = 0;
    double advantage = 0.0;  // 0: none is better
  };
  Alternative best_alternative() const;
  void judge();
  void raise(const std::string& alarm, bool& is_raised);

  std::deque<Sample> history_;
  std::deque<Verdict> verdicts_;
  std::deque<bool> troubles_;  // frames lost or made keyframes
  std::deque<double> far_;     // depth that 95 % of an image are nearer than, metres
  std::deque<double> medians_;
  cv::Mat last_grey_;  // of a small size
  cv::Mat last_depth_;
  int frozen_ = 0;    // samples in a row whose depth is the same
  int constant_ = 0;  // samples in a row whose depth is the same all over the image
  std::optional<double> last_timestamp_;
  double fx_;
  DepthScale scale_;
  std::size_t samples_ = 0;
  bool is_misfit_ = false;  // an alarm of a kind was raised
  bool is_small_ = false;
  bool is_large_ = false;
  std::vector<std::string> alarms_;
};

}  // namespace roslam
