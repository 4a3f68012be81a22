// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

/// Library that runs the network.
enum class InferenceBackend {
  kAutomatic,   ///< ONNX Runtime if the build found it, else OpenCV
  kOpenCv,      ///< OpenCV's dnn module
  kOnnxRuntime  ///< ONNX Runtime, optional and faster
};

inline constexpr int kSegmenterMultiple = 32;  ///< pixels; both sides of its input are multiples of this

struct ROSLAM_EXPORT SegmenterOptions {
  int working_side = 416;  ///< pixels, longer side of the network's input; less is faster, more is finer

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
