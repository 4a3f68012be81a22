// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/output.hpp"

#include <cstdio>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

void write_image_fast(const std::filesystem::path& file, const cv::Mat& image) {
  write_image(file, image, {cv::IMWRITE_PNG_COMPRESSION, 1});
}

void require_written_output() {
  if (std::fflush(stdout) != 0 || !std::cout.flush()) {
    throw OutputError("stdout: cannot be written in full; check the disk or the pipe");
  }
}

std::string in_words(const std::map<std::string, std::size_t>& counts) {
  std::string all;
  for (const auto& [reason, count] : counts) all += "; " + std::to_string(count) + " x " + reason;
  return all;
}

}  // namespace roslam::app
