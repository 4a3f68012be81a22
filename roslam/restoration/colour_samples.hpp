// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/restoration/fours.hpp"

namespace roslam {

/// A pixel's colour in one source.
struct ColourSample {
  cv::Vec3f colour;  ///< BGR
  float weight;
  float age;  ///< seconds
};

/// The colours of a pixel in all sources that show it, and which of them is typical.
class ColourSamples {
 public:
  /// tolerance: grey levels by which agreeing colours may differ.
  explicit ColourSamples(float tolerance) : tolerance_(tolerance) {}

  void clear() { samples_.clear(); }
  void add(const ColourSample& sample) { samples_.push_back(sample); }
  const std::vector<ColourSample>& all() const { return samples_; }

  bool agree(const ColourSample& a, const ColourSample& b) const {
    return difference(a.colour, b.colour) <= tolerance_;
  }

  /// Whether any two of the colours are sure to agree.
  bool all_agree() const;

  /// The weighted medoid of the colours, or, if most sources differ from it, the unweighted one: a shadow or
  /// a missed dynamic object may dominate the sources close in time, but not all of them. There must be a
  /// sample.
  const ColourSample& consensus();

 private:
  static float difference(const cv::Vec3f& a, const cv::Vec3f& b) {
    return (std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2])) / 3.0F;
  }
  const ColourSample& medoid(bool is_weighted);

  float tolerance_;
  std::vector<ColourSample> samples_;
  std::vector<Four> blue_, green_, red_, cost_;  // scratch, of the samples
};

}  // namespace roslam
