// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "roslam/common/export.hpp"
#include "roslam/common/file_descriptor.hpp"

namespace roslam {

/// A file that grows by whole pieces, such as lines of a text or chunks of a recording, and survives a
/// program that is killed and a full disk: of a piece that does not fit nothing stays. A power cut costs what
/// was appended since sync(). Not thread safe.
class ROSLAM_EXPORT AppendedFile {
 public:
  /// Makes the file with its first piece, in place of an older one. Throws OutputError.
  AppendedFile(std::filesystem::path file, std::string_view header);

  /// Appends a piece. Returns false if it cannot be written now; the file is as before then.
  bool append(std::string_view bytes);

  /// Waits until what was appended is on the disk. Returns false if the disk refused it.
  bool sync();

  /// Replaces the whole content at once. Throws OutputError; the file is as before then.
  void replace(std::string_view content);

  const std::filesystem::path& path() const { return file_; }

 private:
  void open();

  std::filesystem::path file_;
  FileDescriptor descriptor_;
  std::size_t size_ = 0;  // bytes that are surely there
};

}  // namespace roslam
