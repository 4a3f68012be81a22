// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/tum_writer.hpp"

#include <cstdint>
#include <limits>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam::app {

cv::Mat packed_depth(const cv::Mat& depth, double units_per_metre) {
  constexpr double kLargest = std::numeric_limits<std::uint16_t>::max();
  cv::Mat image;
  depth.convertTo(image, CV_16U, units_per_metre);  // saturates at the largest value
  image.setTo(0, depth * units_per_metre > kLargest);
  return image;
}

TextFile::TextFile(std::filesystem::path file) : file_(std::move(file)), stream_(file_) { check(); }

void TextFile::line(const std::string& text) {
  stream_ << text << "\n";
  check();
}

void TextFile::close() {
  stream_.close();
  check();
}

void TextFile::check() const {
  if (!stream_)
    throw OutputError("cannot write " + file_.string() + ": is the folder writable and the disk not full?");
}

}  // namespace roslam::app
