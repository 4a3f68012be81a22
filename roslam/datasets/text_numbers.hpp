// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/geometry/calibration_file.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam::datasets {

/// True if there is such a file or folder; does not throw.
bool is_present(const std::filesystem::path& path);

/// The words of a line: separated by blanks or commas.
std::vector<std::string_view> words_of(std::string_view line);

/// A number, which may be nan or inf, or nothing. It does not depend on the locale.
std::optional<double> number_from(std::string_view word);

/// The numbers of a line, or nothing if a word is none.
std::optional<std::vector<double>> numbers_of(std::string_view line);

/// Calls visit(number of the line, line) for the lines of a text file that are neither empty nor a comment
/// (#). remedy: what to do if it is missing. Throws InputError if it is no regular file, cannot be opened, is
/// larger than 256 MB or has a line of more than 64 kB.
void for_each_line(const std::filesystem::path& file, const std::string& remedy,
                   const std::function<void(std::size_t, std::string_view)>& visit);

/// The 4x4 matrix of a file, row by row; nothing if the file is missing or is no such matrix.
std::optional<Eigen::Matrix4d> read_matrix(const std::filesystem::path& file);

/// A file of calibration in YAML. remedy: what to do if it is missing. Throws InputError if it is no regular
/// file, cannot be read, or is larger than 1 MB.
CalibrationPart open_calibration(const std::filesystem::path& file, const std::string& remedy);

/// Sixteen numbers as a matrix, row by row.
Eigen::Matrix4d matrix_from(const std::vector<double>& numbers);

/// The files of a folder named PREFIX NUMBER SUFFIX, by their number; of several suffixes the first. Throws
/// InputError if there are more than a million.
std::map<long, std::filesystem::path> numbered_files(const std::filesystem::path& folder,
                                                     const std::string& prefix,
                                                     const std::vector<std::string>& suffixes);

}  // namespace roslam::datasets
