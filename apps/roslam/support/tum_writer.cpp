// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/tum_writer.hpp"

#include <cstdint>
#include <limits>
#include <system_error>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

cv::Mat packed_depth(const cv::Mat& depth, double units_per_metre) {
  constexpr double kLargest = std::numeric_limits<std::uint16_t>::max();
  cv::Mat image;
  depth.convertTo(image, CV_16U, units_per_metre);  // saturates at the largest value
  image.setTo(0, depth * units_per_metre > kLargest);
  return image;
}

TextFile::TextFile(std::filesystem::path file)
    : file_(std::move(file)),
      part_(is_device(file_) ? file_ : std::filesystem::path(file_) += ".part"),
      stream_(part_) {
  check();
  std::error_code error;
  if (part_ != file_) std::filesystem::remove(file_, error);
}

TextFile::~TextFile() {
  std::error_code error;
  if (!is_whole_ && part_ != file_) std::filesystem::remove(part_, error);
}

void TextFile::line(const std::string& text) {
  stream_ << text << "\n";
  check();
}

void TextFile::close() {
  stream_.close();
  check();
  std::error_code error;
  if (part_ != file_) std::filesystem::rename(part_, file_, error);
  if (error) throw OutputError(file_.string() + ": cannot be written: " + error.message());
  is_whole_ = true;
}

void TextFile::check() const {
  if (!stream_)
    throw OutputError("cannot write " + file_.string() + ": is the folder writable and the disk not full?");
}

}  // namespace roslam::app
