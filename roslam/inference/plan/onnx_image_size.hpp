// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace roslam {

/// Returns an ONNX file with the height and width of its input and output images made variable: ONNX Runtime
/// enforces the values in the file, while the networks work at any size. Does not throw: what is not an ONNX
/// file is returned unchanged.
std::string with_open_image_size(std::string onnx);

}  // namespace roslam
