// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/dense_options.hpp"

#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

void DenseOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("dense.") + message);
  };
  require(voxel_size == 0.0 || (voxel_size >= 0.001 && voxel_size <= 10.0),
          "voxel_size must be 0 (chosen by the first keyframe) or 0.001 to 10 metres");
  require(max_depth > 0.0 && max_depth <= 65.0, "max_depth must be above 0 and at most 65 metres");
  require(stride >= 1 && stride <= 16, "stride must be 1 to 16 pixels");
  require(truncation >= 2.0 && truncation <= 20.0, "truncation must be 2 to 20 voxels");
  require(min_weight >= 0.0 && min_weight <= 60.0, "min_weight must be 0 to 60");
  require(follow > 0.0 && follow <= 100.0, "follow must be above 0 and at most 100 voxels");
  require(follow_every >= 1 && follow_every <= 100000, "follow_every must be 1 to 100000 keyframes");
  require(queue >= 1 && queue <= 10000, "queue must be 1 to 10000 keyframes");
  require(max_memory >= 16 && max_memory <= 1000000, "max_memory must be 16 to 1000000 MB");
}

}  // namespace roslam
