// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "roslam/common/export.hpp"

namespace roslam {

/// A text file that grows by whole lines and survives a program that is killed, a power cut and a full disk:
/// what was appended is flushed to the disk, and of lines that do not fit nothing stays. Not thread safe.
class ROSLAM_EXPORT AppendedFile {
 public:
  /// Makes the file with its first line, in place of an older one. Throws OutputError.
  AppendedFile(std::filesystem::path file, std::string_view header);
  ~AppendedFile();
  AppendedFile(const AppendedFile&) = delete;
  AppendedFile& operator=(const AppendedFile&) = delete;

  /// Appends lines. Returns false if they cannot be written now; the file is as before then.
  bool append(std::string_view lines);

  /// Waits until what was appended is on the disk. Returns false if the disk refused it.
  bool sync();

  /// Replaces the whole content at once. Throws OutputError; the file is as before then.
  void replace(std::string_view content);

  const std::filesystem::path& path() const { return file_; }

 private:
  void open();

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t size_ = 0;  // bytes that are surely there
};

}  // namespace roslam
