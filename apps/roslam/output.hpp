// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

namespace roslam::app {

/// Writes a picture in the format that the file's ending names; PNG fast rather than small. Throws
/// OutputError if it cannot be written in full.
void write_picture(const std::filesystem::path& file, const cv::Mat& picture);

/// Writes what stdout still holds back. Throws OutputError if anything written to it was lost.
void require_written_output();

/// Reasons and how often each was met, as the end of an error: "; 3 x no depth; 1 x truncated".
std::string in_words(const std::map<std::string, std::size_t>& counts);

}  // namespace roslam::app
