// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/appended_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam {

AppendedFile::AppendedFile(std::filesystem::path file, std::string_view header) : file_(std::move(file)) {
  replace_file(file_, header);
  open();
}

void AppendedFile::open() {
  descriptor_ = FileDescriptor(::open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  struct stat status {};
  if (!descriptor_ || fstat(descriptor_.get(), &status) != 0)
    throw OutputError(file_.string() + ": cannot be opened for appending; choose another --out");
  size_ = static_cast<std::size_t>(status.st_size);
}

bool AppendedFile::append(std::string_view bytes) {
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = write(descriptor_.get(), bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    written += static_cast<std::size_t>(count);
  }
  if (written < bytes.size()) {
    // A part of a piece would pass for a whole one.
    if (written > 0 && ftruncate(descriptor_.get(), static_cast<off_t>(size_)) != 0) size_ += written;
    return false;
  }
  size_ += bytes.size();
  return true;
}

bool AppendedFile::sync() {
  return fdatasync(descriptor_.get()) == 0 || errno == EINVAL ||
         errno == EROFS;  // EINVAL: a device or a pipe
}

void AppendedFile::replace(std::string_view content) {
  replace_file(file_, content);
  open();
}

}  // namespace roslam
