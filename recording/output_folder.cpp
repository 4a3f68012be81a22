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
constexpr const char* kMark = ".roslam";  // a line "COMMAND NAME" for each file or folder written

std::set<std::string> read_marks(const fs::path& folder) {
  std::set<std::string> marks;
  std::ifstream in(folder / kMark);
  for (std::string line; std::getline(in, line);) marks.insert(line);
  return marks;
}
}  // namespace

bool is_file_or_folder(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::is_regular_file(status) || fs::is_directory(status);
}

FolderLock::FolderLock(const fs::path& folder) {
  make_folder(folder);
  descriptor_ = FileDescriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!descriptor_ || flock(descriptor_.get(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  throw OutputError(folder.string() +
                    ": another roslam writes to this folder; wait for it or choose another --out");
}

OutputFolder::OutputFolder(const fs::path& path, const std::string& command,
                           const std::vector<std::string>& names, bool overwrite)
    : path_(path), command_(command), lock_(path), overwrites_(overwrite), marks_(read_marks(path)) {
  for (const auto& name : names) require_free(name);
  for (const auto& name : names) {
    claim(name);
    std::error_code error;
    const bool is_file = fs::is_regular_file(path_ / name, error);
    error.clear();  // it need not exist
    if (is_file) fs::remove(path_ / name, error);
    if (error) throw OutputError((path_ / name).string() + ": cannot be replaced; choose another --out");
  }
}

void OutputFolder::require_free(const std::string& name) const {
  if (!is_file_or_folder(path_ / name)) return;
  if (overwrites_ || marks_.count(command_ + " " + name) > 0) return;
  throw OutputError(path_.string() + ": holds " + name + ", which roslam " + command_ +
                    " did not write; choose another --out, or replace it with --overwrite");
}

void OutputFolder::claim(const std::string& name) {
  require_free(name);
  const std::string mark = command_ + " " + name;
  if (!marks_.insert(mark).second) return;
  std::ofstream out(path_ / kMark, std::ios::app);
  if (!(out << mark << "\n").flush())
    throw OutputError((path_ / kMark).string() + ": cannot be written; check the folder and the disk");
}

}  // namespace roslam::recording
