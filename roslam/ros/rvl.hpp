// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

namespace roslam {

/// Decodes a depth image that was compressed without loss by RVL (Wilson 2017, "Fast Lossless Depth Image
/// Compression") and written by compressed_depth_image_transport: width and height as 32-bit numbers, then
/// the stream. The stream has, in turn, the number of pixels that are 0, the number of those that are not,
/// and of each of the latter its difference from the one before. Returns CV_16UC1. Throws InputError for a
/// stream that is truncated or does not fit the size, and for an image of more than 2^26 pixels.
cv::Mat decode_rvl(std::span<const std::uint8_t> bytes);

}  // namespace roslam
