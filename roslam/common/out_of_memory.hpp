// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <filesystem>
#include <new>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

/// True for the exceptions that the standard library and OpenCV throw when memory runs out.
inline bool is_out_of_memory(const std::exception& error) {
  const auto* from_opencv = dynamic_cast<const cv::Exception*>(&error);
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
         (from_opencv != nullptr && from_opencv->code == cv::Error::StsNoMem);
}

/// Throws MemoryError naming the file and a remedy besides closing programs if memory ran out. Without this,
/// a valid file that is too large for this machine would be reported as damaged.
inline void throw_if_out_of_memory(const std::exception& error, const std::filesystem::path& file,
                                   const std::string& remedy) {
  if (!is_out_of_memory(error)) return;
  throw MemoryError(file.string() + ": needs more memory than is left; close other programs or " + remedy);
}

}  // namespace roslam
