// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/ros_images.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "roslam/common/error.hpp"
#include "roslam/ros/rvl.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam {

namespace {
constexpr int kNoConversion = -1;

// An encoding of raw images (sensor_msgs/image_encodings.hpp), and how OpenCV makes BGR of it.
struct Encoding {
  std::string_view name;
  int type;
  int to_bgr;
  PixelKind kind;
};

// OpenCV names Bayer patterns by the second row and column.
constexpr std::array kEncodings{
    Encoding{"rgb8", CV_8UC3, cv::COLOR_RGB2BGR, PixelKind::kColour},
    Encoding{"bgr8", CV_8UC3, kNoConversion, PixelKind::kColour},
    Encoding{"8UC3", CV_8UC3, kNoConversion, PixelKind::kColour},
    Encoding{"rgba8", CV_8UC4, cv::COLOR_RGBA2BGR, PixelKind::kColour},
    Encoding{"bgra8", CV_8UC4, cv::COLOR_BGRA2BGR, PixelKind::kColour},
    Encoding{"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY, PixelKind::kColour},
    Encoding{"uyvy", CV_8UC2, cv::COLOR_YUV2BGR_UYVY, PixelKind::kColour},
    Encoding{"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUY2, PixelKind::kColour},
    Encoding{"yuyv", CV_8UC2, cv::COLOR_YUV2BGR_YUY2, PixelKind::kColour},
    Encoding{"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2BGR, PixelKind::kColour},
    Encoding{"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2BGR, PixelKind::kColour},
    Encoding{"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2BGR, PixelKind::kColour},
    Encoding{"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2BGR, PixelKind::kColour},
    Encoding{"mono8", CV_8UC1, cv::COLOR_GRAY2BGR, PixelKind::kGrey},
    Encoding{"8UC1", CV_8UC1, cv::COLOR_GRAY2BGR, PixelKind::kGrey},
    Encoding{"mono16", CV_16UC1, kNoConversion, PixelKind::kDepth},
    Encoding{"16UC1", CV_16UC1, kNoConversion, PixelKind::kDepth},
    Encoding{"32FC1", CV_32FC1, kNoConversion, PixelKind::kDepth},
};

const Encoding* encoding_of(const RosImage& image) {
  const auto found = std::find_if(kEncodings.begin(), kEncodings.end(),
                                  [&](const Encoding& known) { return known.name == image.encoding; });
  return found == kEncodings.end() ? nullptr : &*found;
}

bool is_compressed_depth(const RosImage& image) {
  return image.is_compressed && image.encoding.find("compressedDepth") != std::string::npos;
}

// The pixels, in the memory of the message where that is possible.
cv::Mat raw_pixels(const RosImage& image, const Encoding& encoding) {
  const std::size_t row =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(CV_ELEM_SIZE(encoding.type));
  if (image.step < row) throw InputError("image whose rows are shorter than its width");
  if (image.step % CV_ELEM_SIZE1(encoding.type) != 0) throw InputError("image whose rows end within a pixel");
  auto* data = const_cast<std::uint8_t*>(image.data.data());  // of cv::Mat; not written to
  const cv::Mat bytes(image.height, static_cast<int>(row), CV_8UC1, data, image.step);
  if (CV_ELEM_SIZE1(encoding.type) == 1)
    return cv::Mat(image.height, image.width, encoding.type, data, image.step);
  // Wider numbers need not be aligned in a message.
  cv::Mat aligned(image.height, image.width, encoding.type);
  for (int y = 0; y < image.height; ++y) std::memcpy(aligned.ptr(y), bytes.ptr(y), row);
  return aligned;
}

// OpenCV would try all formats that it has been built with, some of which allocate what damaged bytes say.
bool is_jpeg_or_png(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> kJpeg{0xff, 0xd8, 0xff};
  constexpr std::array<std::uint8_t, 8> kPng{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const auto begins_with = [&](const auto& mark) {
    return bytes.size() > mark.size() && std::equal(mark.begin(), mark.end(), bytes.begin());
  };
  return begins_with(kJpeg) || begins_with(kPng);
}

cv::Mat decoded(std::span<const std::uint8_t> bytes, int flags) {
  if (!is_jpeg_or_png(bytes)) throw InputError("compressed image is neither JPEG nor PNG");
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw InputError("compressed image is too large");
  cv::Mat image;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<std::uint8_t*>(bytes.data()));
    image = cv::imdecode(buffer, flags);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw InputError("compressed image cannot be decoded");
  return image;
}

// compressed_depth_image_transport puts the kind of image and two numbers before a PNG or RVL. For 32FC1 they
// say how inverse depth was quantised: depth = first / (value - second).
cv::Mat compressed_depth(const RosImage& image, double units_per_metre, std::size_t* saturated) {
  constexpr std::size_t kHeader = 12;
  if (image.data.size() <= kHeader) throw InputError("compressedDepth image is truncated");
  std::array<float, 2> quantisation{};
  std::memcpy(quantisation.data(), image.data.data() + 4, sizeof(quantisation));
  const auto bytes = image.data.subspan(kHeader);
  const bool is_rvl = image.encoding.find("rvl") != std::string::npos;
  const cv::Mat raw = is_rvl ? decode_rvl(bytes) : decoded(bytes, cv::IMREAD_UNCHANGED);
  if (raw.type() != CV_16UC1) throw InputError("compressedDepth image is not of 16 bits");
  if (!image.encoding.starts_with("32FC1")) return depth_to_metres(raw, units_per_metre, saturated);
  cv::Mat metres = cv::Mat::zeros(raw.size(), CV_32FC1);
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const auto value = static_cast<float>(raw.at<std::uint16_t>(y, x));
      const float depth = quantisation[0] / (value - quantisation[1]);
      if (value > 0.0F && depth > 0.0F && depth < 1e4F) metres.at<float>(y, x) = depth;
    }
  }
  return metres;
}

[[noreturn]] void refuse(const RosImage& image, const char* what) {
  constexpr std::size_t kLongest = 64;  // of a name
  throw InputError("image of the encoding '" + image.encoding.substr(0, kLongest) + "' is not " + what);
}
}  // namespace

PixelKind kind_of(const RosImage& image) {
  if (image.is_compressed) return is_compressed_depth(image) ? PixelKind::kDepth : PixelKind::kColour;
  const Encoding* encoding = encoding_of(image);
  return encoding == nullptr ? PixelKind::kUnknown : encoding->kind;
}

cv::Mat colour_pixels(const RosImage& image) {
  if (image.is_compressed) {
    if (is_compressed_depth(image)) refuse(image, "colour");
    return decoded(image.data, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  }
  const Encoding* encoding = encoding_of(image);
  if (encoding == nullptr || encoding->kind == PixelKind::kDepth)
    refuse(image, "supported as colour or grey");
  const cv::Mat raw = raw_pixels(image, *encoding);
  cv::Mat colour;
  try {
    if (encoding->to_bgr == kNoConversion)
      raw.copyTo(colour);
    else
      cv::cvtColor(raw, colour, encoding->to_bgr);
  } catch (const cv::Exception&) {
    throw InputError("image of the encoding '" + image.encoding + "' cannot be converted");
  }
  return colour;
}

cv::Mat depth_pixels(const RosImage& image, double units_per_metre, std::size_t* saturated) {
  if (saturated != nullptr) *saturated = 0;
  if (is_compressed_depth(image)) return compressed_depth(image, units_per_metre, saturated);
  const Encoding* encoding = image.is_compressed ? nullptr : encoding_of(image);
  if (encoding == nullptr || encoding->kind != PixelKind::kDepth) refuse(image, "depth");
  const cv::Mat raw = raw_pixels(image, *encoding);
  if (encoding->type == CV_16UC1) return depth_to_metres(raw, units_per_metre, saturated);
  cv::Mat metres;
  raw.copyTo(metres);
  cv::patchNaNs(metres, 0.0);
  metres.setTo(0.0F, (metres < 0.0F) | (metres > 1e4F));
  return metres;
}

}  // namespace roslam
