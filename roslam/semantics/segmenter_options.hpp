// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

inline constexpr int kSegmenterMultiple = 32;  ///< pixels; both sides of its input are multiples of this

struct ROSLAM_EXPORT SegmenterOptions {
  int working_side = 480;  ///< pixels, longer side of the network's input; less is faster, more is finer
  int threads = 1;         ///< of the own engine for one image, 1 to 4

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
