// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace roslam {

/// An ONNX file names the height and width of its input picture, which ONNX Runtime insists on; the networks
/// themselves work at any. Returns the same file with both left open. Throws nothing: what is no ONNX file
/// comes back as it is.
std::string with_open_picture_size(std::string onnx);

}  // namespace roslam
