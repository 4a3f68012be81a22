// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/image_file.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "roslam/common/error.hpp"
#include "roslam/common/out_of_memory.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam {

namespace {
constexpr int kNoDepth = 65535;

// Position of the end marker of a JPEG file (ITU-T T.81 annex B), or npos. Segments are skipped by their
// length, as a thumbnail in one has an end marker of its own.
std::size_t end_of_jpeg(std::string_view bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  std::size_t at = 2;
  while ((at = bytes.find('\xff', at)) != std::string_view::npos && at + 1 < bytes.size()) {
    const unsigned char marker = byte(at + 1);
    if (marker == 0xd9) return at;
    const bool is_restart = marker >= 0xd0 && marker <= 0xd7;
    if (marker == 0xff) {  // fill byte
      ++at;
    } else if (marker == 0x00 || marker == 0x01 || is_restart) {  // no segment: coded data, or no length
      at += 2;
    } else {
      if (at + 3 >= bytes.size()) break;
      at += 2 + static_cast<std::size_t>(byte(at + 2) << 8 | byte(at + 3));
    }
  }
  return std::string_view::npos;
}

// Decoders fill in the missing part of a truncated file and report success, so check for the end marker here.
// What follows it does not matter: some cameras pad their files.
bool is_complete(const std::vector<char>& bytes) {
  const std::string_view view(bytes.data(), bytes.size());
  if (view.starts_with("\x89PNG")) return view.rfind("IEND") != std::string_view::npos;
  if (view.starts_with("\xff\xd8")) return end_of_jpeg(view) != std::string_view::npos;
  return true;
}

// The largest of the few numbers of bits that cameras have.
int bits_in_use(const cv::Mat& image) {
  double largest = 0.0;
  cv::minMaxLoc(image.reshape(1), nullptr, &largest);
  for (const int bits : {8, 10, 12, 14}) {
    if (largest < 1 << bits) return bits;
  }
  return 16;
}

// The value that a depth image has where the sensor measured nothing, other than 0 and 65535; 0 if it has
// none.
int saturation_value(const cv::Mat& raw) {
  double largest = 0.0;
  cv::minMaxLoc(raw, nullptr, &largest, nullptr, nullptr, raw != kNoDepth);
  const int value = static_cast<int>(largest);
  const auto is_power_of_two = [](int number) { return number >= 1 << 11 && (number & (number - 1)) == 0; };
  if (!is_power_of_two(value) && !is_power_of_two(value + 1)) return 0;
  constexpr double kLeastShare = 1e-3;  // of the image
  const int saturated = cv::countNonZero(raw == value);
  const int below = cv::countNonZero(raw > value - value / 64) - cv::countNonZero(raw >= value);
  return saturated >= kLeastShare * static_cast<double>(raw.total()) && saturated > below ? value : 0;
}

ImageFile read_image(const std::filesystem::path& file, int flags) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return {{}, "is missing"};
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes;
  try {  // a folder opens like a file and fails when read, as does a bad disk
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  } catch (const std::ios_base::failure&) {
    return {{}, "cannot be read"};
  }
  if (!in) return {{}, "cannot be read"};
  if (bytes.empty() || !is_complete(bytes)) return {{}, "is truncated"};
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, flags);
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error, file, "shrink it");
    image.release();
  }
  if (image.empty()) return {{}, "cannot be decoded"};
  return {image, {}};
}
}  // namespace

ImageFile read_colour_image(const std::filesystem::path& file, int min_bits) {
  ImageFile read = read_image(file, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  if (!read.error.empty() || read.image.type() == CV_8UC3) return read;
  if (read.image.type() != CV_16UC3) return {{}, "has pixels of neither 8 nor 16 bits"};
  read.bits = std::max(min_bits, bits_in_use(read.image));
  read.image.convertTo(read.image, CV_8UC3, 255.0 / ((1 << read.bits) - 1));
  return read;
}

ImageFile read_depth_image(const std::filesystem::path& file) {
  ImageFile read = read_image(file, cv::IMREAD_UNCHANGED);
  if (read.error.empty() && read.image.type() != CV_16UC1) return {{}, "is not a 16-bit grey image"};
  return read;
}

ImageFile read_label_image(const std::filesystem::path& file) {
  ImageFile read = read_image(file, cv::IMREAD_UNCHANGED);
  if (read.error.empty() && read.image.type() != CV_8UC1) return {{}, "is not an 8-bit grey image"};
  return read;
}

cv::Mat depth_to_metres(const cv::Mat& raw, double units_per_metre, std::size_t* saturated) {
  cv::Mat metres;
  raw.convertTo(metres, CV_32FC1, 1.0 / units_per_metre);
  cv::Mat unknown = raw == kNoDepth;
  if (const int value = saturation_value(raw); value > 0) unknown |= raw == value;
  metres.setTo(0.0F, unknown);
  if (saturated != nullptr) *saturated = static_cast<std::size_t>(cv::countNonZero(unknown));
  return metres;
}

void write_image(const std::filesystem::path& file, const cv::Mat& image,
                 const std::vector<int>& parameters) {
  // Encoded in memory and then written, as cv::imwrite does not detect a full disk.
  std::vector<unsigned char> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(file.extension().string(), image, bytes, parameters);
  } catch (const cv::Exception& error) {  // unsupported format, reported below
    throw_if_out_of_memory(error, file, "shrink it");
  }
  if (!encoded) {
    throw OutputError(file.string() +
                      ": this OpenCV cannot write such images; build it with libpng and libjpeg");
  }
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace roslam
