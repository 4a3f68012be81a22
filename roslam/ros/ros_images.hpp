// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "roslam/ros/ros_messages.hpp"

namespace roslam {

/// What the pixels of an image are.
enum class PixelKind { kColour, kGrey, kDepth, kUnknown };

/// By the encoding: rgb8, bgr8, rgba8, bgra8, yuv422, bayer_*8 are colour, mono8 is grey; 16UC1 and 32FC1 are
/// depth, and so is mono16, which infra-red images have as well; a compressed image is colour, or depth for
/// compressedDepth.
PixelKind kind_of(const RosImage& image);

/// The pixels as CV_8UC3 (BGR); grey becomes colour. Throws InputError, without the name of the file, for an
/// encoding that is not of colour or grey, or data that cannot be decoded.
cv::Mat colour_pixels(const RosImage& image);

/// The pixels of a depth image as CV_32FC1 metres, 0 where unknown. 16 bit: units_per_metre; 32FC1: metres.
/// compressedDepth: as PNG or RVL. saturated: if not null, receives the number of pixels at the end of the
/// sensor's range. Throws likewise.
cv::Mat depth_pixels(const RosImage& image, double units_per_metre, std::size_t* saturated = nullptr);

}  // namespace roslam
