// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

namespace roslam::app {

/// Writes an image in the format of the file's extension; PNG with fast compression. Throws OutputError if it
/// cannot be written in full.
void write_image_fast(const std::filesystem::path& file, const cv::Mat& image);

/// Flushes stdout. Throws OutputError if anything written to it was lost, except where nobody reads it any
/// more: a closed pipe, a terminal that vanished.
void require_written_output();

/// Reasons with their counts, as the end of an error message: "; 3 x no depth; 1 x truncated".
std::string in_words(const std::map<std::string, std::size_t>& counts);

/// Prints them on stdout, a line each: "note: camera was lost (2 times)". kind: "note: ".
void print_counts(const char* kind, const std::map<std::string, std::size_t>& counts);

}  // namespace roslam::app
