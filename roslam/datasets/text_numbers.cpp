// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/text_numbers.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>

#include "roslam/common/error.hpp"

namespace roslam::datasets {

namespace {
namespace fs = std::filesystem;
constexpr std::string_view kSeparators = " \t\r,\v\f";
constexpr std::uintmax_t kLargestFile = 256U << 20U;
constexpr std::size_t kLongestLine = 64U << 10U;

// As std::getline, but stops at the longest line; false at the end of the file.
bool next_line(std::istream& in, std::string& line, const fs::path& file) {
  line.clear();
  for (auto c = in.rdbuf()->sbumpc(); c != std::char_traits<char>::eof(); c = in.rdbuf()->sbumpc()) {
    if (c == '\n') return true;
    line += static_cast<char>(c);
    if (line.size() > kLongestLine)
      throw InputError(file.string() + ": has a line of more than 64 kB; is it the right text file?");
  }
  return !line.empty();
}

std::optional<long> number_between(std::string_view name, std::string_view prefix, std::string_view suffix) {
  if (name.size() <= prefix.size() + suffix.size()) return std::nullopt;
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return std::nullopt;
  const auto digits = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  if (!std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  constexpr long kLargest = 1'000'000'000;
  long number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && number <= kLargest ? std::make_optional(number) : std::nullopt;
}
}  // namespace

bool is_present(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (auto begin = line.find_first_not_of(kSeparators); begin != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kSeparators, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kSeparators, end);
  }
  return words;
}

std::optional<double> number_from(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  return error == std::errc() ? std::make_optional(value) : std::nullopt;
}

std::optional<std::vector<double>> numbers_of(std::string_view line) {
  std::vector<double> numbers;
  for (const auto word : words_of(line)) {
    const auto number = number_from(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

void for_each_line(const fs::path& file, const std::string& remedy,
                   const std::function<void(std::size_t, std::string_view)>& visit) {
  std::error_code error;
  // A device or a pipe has no end.
  if (!fs::is_regular_file(file, error)) throw InputError(file.string() + ": cannot open it; " + remedy);
  if (fs::file_size(file, error) > kLargestFile)
    throw InputError(file.string() + ": is larger than 256 MB; is it the right text file?");
  std::ifstream in(file);
  if (!in) throw InputError(file.string() + ": cannot open it; " + remedy);
  std::string line;
  for (std::size_t number = 1; next_line(in, line, file); ++number) {
    const auto begin = line.find_first_not_of(kSeparators);
    if (begin != std::string::npos && line[begin] != '#') visit(number, line);
  }
}

std::optional<Eigen::Matrix4d> read_matrix(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  std::vector<double> numbers;
  bool is_matrix = true;
  for_each_line(file, "", [&](std::size_t, std::string_view line) {
    const auto row = numbers_of(line);
    is_matrix = is_matrix && row && numbers.size() + row->size() <= 16;
    if (is_matrix) numbers.insert(numbers.end(), row->begin(), row->end());
  });
  if (!is_matrix || numbers.size() != 16) return std::nullopt;
  return matrix_from(numbers);
}

CalibrationPart open_calibration(const fs::path& file, const std::string& remedy) {
  std::error_code error;
  const std::string if_missing = "cannot open it; " + remedy;
  if (!fs::is_regular_file(file, error)) throw InputError(file.string() + ": " + if_missing);
  return {file.string(), "", load_calibration(file, if_missing)};
}

Eigen::Matrix4d matrix_from(const std::vector<double>& numbers) {
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
}

std::map<long, fs::path> numbered_files(const fs::path& folder, const std::string& prefix,
                                        const std::vector<std::string>& suffixes) {
  constexpr std::size_t kMost = 1'000'000;
  std::map<long, fs::path> files;
  std::error_code error;
  for (const std::string& suffix : suffixes) {
    fs::directory_iterator entries(folder, error);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
      const std::string name = entries->path().filename().string();
      const auto number = number_between(name, prefix, suffix);
      if (number) files.try_emplace(*number, entries->path());
      if (files.size() > kMost)
        throw InputError(folder.string() + ": has more than a million images; split the recording");
    }
  }
  return files;
}

}  // namespace roslam::datasets
