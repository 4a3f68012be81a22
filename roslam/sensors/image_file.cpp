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
// Decoders fill in the missing part of a truncated file and report success, so check the end marker here.
bool is_complete(const std::vector<char>& bytes) {
  const std::string_view view(bytes.data(), bytes.size());
  const std::string_view tail = view.substr(view.size() - std::min<std::size_t>(view.size(), 64));
  if (view.starts_with("\x89PNG")) return tail.find("IEND") != std::string_view::npos;
  if (view.starts_with("\xff\xd8")) return tail.find("\xff\xd9") != std::string_view::npos;
  return true;
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

ImageFile read_colour_image(const std::filesystem::path& file) { return read_image(file, cv::IMREAD_COLOR); }

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

cv::Mat depth_to_metres(const cv::Mat& raw, double units_per_metre) {
  cv::Mat metres;
  raw.convertTo(metres, CV_32FC1, 1.0 / units_per_metre);
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
