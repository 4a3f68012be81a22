// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/segmenter_options.hpp"

#include "roslam/common/error.hpp"

namespace roslam {

void SegmenterOptions::validate() const {
  if (working_side < kSegmenterMultiple || working_side > 4096) {
    throw OptionsError("segmenter.working_side must be 32 to 4096 pixels");
  }
  if (threads < 1 || threads > 4) throw OptionsError("segmenter.threads must be 1 to 4");
}

}  // namespace roslam
