// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace roslam {

/// A number that each element of a PLY file has, or a list of them.
struct PlyProperty {
  std::string name;
  std::string type;
  std::string count_type;  ///< empty: one number, not a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

/// Reads a PLY file (ascii or binary little-endian) value by value, in the order of its header.
class PlyReader {
 public:
  /// Reads the header. Throws InputError naming the file and what is wrong with it.
  explicit PlyReader(const std::filesystem::path& file);

  const std::vector<PlyElement>& elements() const { return elements_; }
  const std::vector<std::string>& comments() const { return comments_; }

  /// The next number, which is of that type. Throws InputError if the file ends before, or it is no number.
  double next(const std::string& type);

  [[noreturn]] void fail(const std::string& why) const;

 private:
  void read_header();
  std::string_view line();
  double next_word();

  std::string name_;
  std::string bytes_;
  std::size_t at_ = 0;
  bool is_ascii_ = false;
  std::vector<PlyElement> elements_;
  std::vector<std::string> comments_;
};

}  // namespace roslam
