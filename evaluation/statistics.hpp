// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace roslam::evaluation {

/// Statistics of a set of errors. With a count of 0 every value is NaN.
struct Statistics {
  std::size_t count = 0;
  double rmse = std::numeric_limits<double>::quiet_NaN();  ///< root of the mean square
  double mean = std::numeric_limits<double>::quiet_NaN();
  double median =
      std::numeric_limits<double>::quiet_NaN();  ///< mean of the two middle values for an even count
  double std_dev =
      std::numeric_limits<double>::quiet_NaN();  ///< of the population: rmse^2 = mean^2 + std_dev^2
  double min = std::numeric_limits<double>::quiet_NaN();
  double max = std::numeric_limits<double>::quiet_NaN();
};

Statistics summarise(const std::vector<double>& values);

/// NaN for no values.
double median(std::vector<double> values);

}  // namespace roslam::evaluation
