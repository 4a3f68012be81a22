// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/stereo/stereo_options.hpp"

#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

void StereoOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("stereo.") + message);
  };
  require(min_depth > 0.0 && min_depth < 100.0, "min_depth must be 0 to 100 metres");
  require(min_correlation > 0.0 && min_correlation < 1.0, "min_correlation must be above 0 and below 1");
  require(uniqueness > 0.0 && uniqueness <= 1.0, "uniqueness must be above 0 and at most 1");
  require(disparity_sigma > 0.0 && disparity_sigma < 100.0, "disparity_sigma must be 0 to 100 pixels");
  require(dense_scale >= 0.1 && dense_scale <= 1.0, "dense_scale must be 0.1 to 1");
}

}  // namespace roslam
