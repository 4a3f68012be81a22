// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// An image read from a file, or why it could not be read.
struct ROSLAM_EXPORT ImageFile {
  cv::Mat image;  ///< empty on failure
  std::string
      error;  ///< "is missing", "cannot be read", "is truncated", "cannot be decoded"; empty on success
};

/// Reads a PNG or JPEG as CV_8UC3 (BGR). Truncated files are refused, not filled up with grey.
ROSLAM_EXPORT ImageFile read_colour_image(const std::filesystem::path& file);

/// Reads a 16-bit single-channel image as CV_16UC1.
ROSLAM_EXPORT ImageFile read_depth_image(const std::filesystem::path& file);

/// Reads an 8-bit single-channel label image as CV_8UC1.
ROSLAM_EXPORT ImageFile read_label_image(const std::filesystem::path& file);

/// Writes an image in the format given by the file's extension. parameters: of cv::imencode. Throws
/// OutputError if this OpenCV does not know the format or the file cannot be written in full.
ROSLAM_EXPORT void write_image(const std::filesystem::path& file, const cv::Mat& image,
                               const std::vector<int>& parameters = {});

/// Raw depth units to CV_32FC1 metres; 0 stays 0 (unknown).
ROSLAM_EXPORT cv::Mat depth_to_metres(const cv::Mat& raw, double units_per_metre);

}  // namespace roslam
