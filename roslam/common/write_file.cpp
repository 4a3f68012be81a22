// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/write_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace roslam {

namespace {
// Called before renaming, so that a power cut cannot leave the final name on bytes that were never written.
void flush_to_disk(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  const bool is_written = fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS;
  close(descriptor);
  if (!is_written)
    throw OutputError(file.string() + ": cannot be written in full; check the free space on the disk");
}
}  // namespace

void replace_file(const std::filesystem::path& file, std::string_view bytes) {
  std::filesystem::path part = file;
  part += ".part";
  std::error_code error;
  try {
    write_file(part, bytes);
    flush_to_disk(part);
  } catch (...) {
    std::filesystem::remove(part, error);
    throw;
  }
  std::filesystem::rename(part, file, error);
  if (!error) return;
  const std::string reason = error.message();
  std::filesystem::remove(part, error);
  throw OutputError(file.string() + ": cannot be replaced (" + reason + "); choose another name");
}

}  // namespace roslam
