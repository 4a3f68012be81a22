// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <vector>

namespace roslam::evaluation {

/// A mean over the runs of a recording and its standard error, by the scatter between runs.
struct Contrast {
  double mean = 0.0;
  double sigma = 0.0;

  bool is_above(double sigmas) const { return mean > sigmas * sigma && mean > 0.0; }
};

inline Contrast contrast_of(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : values) sum += value;
  const double mean = values.empty() ? 0.0 : sum / count;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, count > 1.0 ? std::sqrt(squares / (count * (count - 1.0))) : INFINITY};
}

/// An estimate and its standard deviation by the jackknife: by leaving out one run after the other.
/// estimate: of all runs but one; the number of runs: none is left out.
inline Contrast jackknife(std::size_t runs, const std::function<double(std::size_t)>& estimate) {
  std::vector<double> values;
  for (std::size_t left_out = 0; left_out < runs; ++left_out) values.push_back(estimate(left_out));
  const Contrast scatter = contrast_of(values);
  return {estimate(runs), scatter.sigma * std::max(static_cast<double>(runs) - 1.0, 1.0)};
}

}  // namespace roslam::evaluation
