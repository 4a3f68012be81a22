// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace roslam::evaluation {

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

Statistics summarise(const std::vector<double>& values) {
  Statistics result;
  result.count = values.size();
  if (values.empty()) return result;
  const auto count = static_cast<double>(values.size());
  result.mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double squares = 0.0;
  double deviations =
      0.0;  // a second pass: mean of squares minus square of the mean cancels to rounding noise
  for (const double value : values) {
    squares += value * value;
    deviations += (value - result.mean) * (value - result.mean);
  }
  result.rmse = std::sqrt(squares / count);
  result.std_dev = std::sqrt(deviations / count);
  result.median = median(values);
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  result.min = *min;
  result.max = *max;
  return result;
}

}  // namespace roslam::evaluation
