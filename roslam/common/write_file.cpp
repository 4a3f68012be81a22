// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/write_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string>

namespace roslam {

namespace {
namespace fs = std::filesystem;

// file: to be named in messages.
void write_bytes(const fs::path& to, std::string_view bytes, bool is_flushed, const fs::path& file) {
  std::FILE* out = std::fopen(to.c_str(), "wbe");
  if (out == nullptr) {
    throw OutputError(file.string() +
                      ": cannot open for writing; check that its folder exists and is writable");
  }
  const bool is_written = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size() &&
                          std::fflush(out) == 0 &&
                          (!is_flushed || fsync(fileno(out)) == 0 || errno == EINVAL || errno == EROFS);
  const bool is_too_large = !is_written && errno == EFBIG;
  if (std::fclose(out) == 0 && is_written) return;
  throw OutputError(file.string() + ": cannot be written in full; check the " +
                    (is_too_large ? "limit of the file size (ulimit -f)" : "free space on the disk"));
}

void write(const fs::path& file, std::string_view bytes, bool is_flushed) {
  if (is_device(file)) return write_bytes(file, bytes, false, file);
  std::error_code error;
  const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
  const fs::path part = fs::path(target) += ".part";
  try {
    write_bytes(part, bytes, is_flushed, file);
    fs::rename(part, target, error);
    if (error)
      throw OutputError(file.string() + ": cannot be replaced (" + error.message() +
                        "); choose another name");
  } catch (...) {
    fs::remove(part, error);
    throw;
  }
}
}  // namespace

bool is_device(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  return fs::exists(status) && !fs::is_regular_file(status);
}

void write_file(const fs::path& file, std::string_view bytes) { write(file, bytes, false); }
void replace_file(const fs::path& file, std::string_view bytes) { write(file, bytes, true); }

}  // namespace roslam
