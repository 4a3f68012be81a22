// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "roslam/inference/plan/onnx_graph.hpp"

namespace roslam {

/// A region normalisation (eqs. 13 to 17 of the paper) that training/ exports as some forty nodes.
struct RegionNormMatch {
  struct Region {
    std::string share;  ///< value of one channel
    std::vector<float> scale;
    std::vector<float> shift;
  };
  std::string input;
  std::vector<Region> regions;
  float epsilon = 0.0F;
  std::set<std::size_t> nodes;  ///< that it stands for, without the last
};

/// Region normalisations by the index of their last node.
std::map<std::size_t, RegionNormMatch> find_region_norms(const OnnxGraph& graph);

}  // namespace roslam
