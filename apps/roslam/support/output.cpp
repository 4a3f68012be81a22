// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/output.hpp"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

void write_image_fast(const std::filesystem::path& file, const cv::Mat& image) {
  write_image(file, image, {cv::IMWRITE_PNG_COMPRESSION, 1});
}

namespace {
// Asked of the descriptor, as the write that failed may be long past and its errno lost.
bool is_stdout_hung_up() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}
}  // namespace

void require_written_output() {
  const bool is_written = static_cast<bool>(std::cout.flush()) && std::fflush(stdout) == 0;
  if ((!is_written || std::ferror(stdout) != 0) && !is_stdout_hung_up())
    throw OutputError("stdout: cannot be written in full; check the disk");
}

std::string in_words(const std::map<std::string, std::size_t>& counts) {
  std::string all;
  for (const auto& [reason, count] : counts) all += "; " + std::to_string(count) + " x " + reason;
  return all;
}

void print_counts(const char* kind, const std::map<std::string, std::size_t>& counts) {
  for (const auto& [reason, number] : counts)
    std::printf("%s%s%s\n", kind, reason.c_str(),
                number > 1 ? (" (" + std::to_string(number) + " times)").c_str() : "");
}

}  // namespace roslam::app
