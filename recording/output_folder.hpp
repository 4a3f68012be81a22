// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "roslam/common/file_descriptor.hpp"

namespace roslam::recording {

/// Exclusive use of a folder among processes of this program, until it is destroyed or the process ends,
/// however it ends.
class FolderLock {
 public:
  /// Creates the folder if it does not exist. Throws OutputError if that fails or if another process holds
  /// it. On file systems without locks it holds nothing.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  FileDescriptor descriptor_;
};

/// False for a device, a pipe and what does not exist.
bool is_file_or_folder(const std::filesystem::path& path);

/// The folder that a command writes to. Files that the same command wrote before may be replaced; those of
/// anybody else are not touched, unless the user asked for it.
class OutputFolder {
 public:
  /// Creates and locks the folder and notes in it what the command writes. names: files and folders that will
  /// be written; files of an earlier call are removed, as they must not pass for results of this one. Throws
  /// OutputError if another process writes to the folder or if a name exists that the command did not write
  /// and overwrite is false.
  OutputFolder(const std::filesystem::path& path, const std::string& command,
               const std::vector<std::string>& names, bool overwrite);

  /// Claims a further file or folder. Throws OutputError unless it does not exist, is the command's own, or
  /// overwrite.
  void claim(const std::string& name);

 private:
  void require_free(const std::string& name) const;

  std::filesystem::path path_;
  std::string command_;
  FolderLock lock_;
  bool overwrites_;
  std::set<std::string> marks_;  // "COMMAND NAME" of what was written, also by other commands
};

}  // namespace roslam::recording
