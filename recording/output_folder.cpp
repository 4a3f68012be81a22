// SPDX-License-Identifier: BSD-3-Clause
#include "recording/output_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;
constexpr const char* kMark = ".roslam";  // holds the command that wrote the folder

const fs::path& created(const fs::path& folder) {
  make_folder(folder);
  return folder;
}

bool is_marked_by(const fs::path& folder, const std::string& command) {
  std::string word;
  return std::getline(std::ifstream(folder / kMark), word) && word == "roslam " + command;
}
}  // namespace

FolderLock::FolderLock(const fs::path& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(descriptor_);
  throw OutputError(folder.string() +
                    ": another roslam writes to this folder; wait for it or choose another --out");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

OutputFolder::OutputFolder(const fs::path& path, const std::string& command,
                           const std::vector<std::string>& names, bool overwrite)
    : path_(created(path)),
      command_(command),
      lock_(path),
      may_replace_(overwrite || is_marked_by(path, command)) {
  for (const auto& name : names) require_free(name);
  write_file(path_ / kMark, "roslam " + command + "\n");
  for (const auto& name : names) {
    std::error_code error;
    const bool is_file = fs::is_regular_file(path_ / name, error);
    error.clear();  // it need not exist
    if (is_file) fs::remove(path_ / name, error);
    if (error) throw OutputError((path_ / name).string() + ": cannot be replaced; choose another --out");
  }
}

void OutputFolder::require_free(const fs::path& name) const {
  std::error_code error;
  if (may_replace_ || !fs::exists(path_ / name, error)) return;
  throw OutputError(path_.string() + ": holds " + name.string() + ", which roslam " + command_ +
                    " did not write; choose another --out, or replace it with --overwrite");
}

}  // namespace roslam::recording
