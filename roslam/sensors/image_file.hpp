// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// An image read from a file, or why it could not be read.
struct ROSLAM_EXPORT ImageFile {
  cv::Mat image;      ///< empty on failure
  std::string error;  ///< "is missing", "is truncated", "cannot be decoded" and so on; empty on success
  int bits = 8;       ///< in use of each channel of a colour image: 8, or 10, 12, 14 or 16 of a 16-bit file
};

/// Reads a PNG or JPEG as CV_8UC3 (BGR). Truncated files are refused, not filled up with grey. Pixels are
/// taken as stored: an orientation in the metadata is ignored, as it would turn colour and not depth. Files
/// of 16 bits a channel are reduced to 8 by the bits in use, at least min_bits: those of the largest value so
/// far keep the brightness of a sequence constant.
ROSLAM_EXPORT ImageFile read_colour_image(const std::filesystem::path& file, int min_bits = 8);

/// Reads a 16-bit single-channel image as CV_16UC1.
ROSLAM_EXPORT ImageFile read_depth_image(const std::filesystem::path& file);

/// Reads an 8-bit single-channel label image as CV_8UC1.
ROSLAM_EXPORT ImageFile read_label_image(const std::filesystem::path& file);

/// Writes an image in the format given by the file's extension. parameters: of cv::imencode. Throws
/// OutputError if this OpenCV does not know the format or the file cannot be written in full.
ROSLAM_EXPORT void write_image(const std::filesystem::path& file, const cv::Mat& image,
                               const std::vector<int>& parameters = {});

/// Raw depth (CV_16UC1) to CV_32FC1 metres; 0 stays 0 (unknown). Values at the end of the sensor's range mean
/// unknown as well and become 0: 65535, and 2^n - 1 or 2^n (n from 11) where it is the largest value and more
/// frequent than the values below. saturated: if not null, receives the number of such pixels.
ROSLAM_EXPORT cv::Mat depth_to_metres(const cv::Mat& raw, double units_per_metre,
                                      std::size_t* saturated = nullptr);

}  // namespace roslam
