// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace roslam {

/// A scalar or list property of a PLY element.
struct PlyProperty {
  std::string name;
  std::string type;
  std::string count_type;  ///< type of the list's length; empty: a scalar
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

/// Reads a PLY file (ascii or binary little-endian) value by value, in the order of its header.
class PlyReader {
 public:
  /// Reads the header. Throws InputError naming the file and the fault.
  explicit PlyReader(const std::filesystem::path& file);

  const std::vector<PlyElement>& elements() const { return elements_; }
  const std::vector<std::string>& comments() const { return comments_; }

  /// The next value, of that PLY type. Throws InputError at the end of the file or if it is not a number.
  double next(const std::string& type);

  /// Throws InputError naming the file.
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
