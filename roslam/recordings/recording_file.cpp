// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/recording_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "roslam/common/error.hpp"

namespace roslam {

RecordingFile::RecordingFile(const std::filesystem::path& path)
    : name_(path.string()), descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status {};
  if (!descriptor_ || fstat(descriptor_.get(), &status) != 0)
    throw InputError(name_ + ": cannot be opened (" + std::generic_category().message(errno) +
                     "); give the path of a recording");
  if (!S_ISREG(status.st_mode)) throw InputError(name_ + ": not a file; give the path of a recording");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

ByteSpan RecordingFile::view(std::uint64_t offset, std::size_t count) {
  if (offset >= size_) return {};
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - offset));
  if (offset < window_begin_ || offset + count > window_begin_ + window_.size()) {
    window_.clear();  // if reading throws, nothing is left
    std::vector<std::uint8_t> window(
        static_cast<std::size_t>(std::min<std::uint64_t>(kWindow, size_ - offset)));
    read(offset, window);
    window_ = std::move(window);
    window_begin_ = offset;
  }
  return ByteSpan(window_).subspan(static_cast<std::size_t>(offset - window_begin_), count);
}

void RecordingFile::read(std::uint64_t offset, std::span<std::uint8_t> into) const {
  while (!into.empty()) {
    const ssize_t count = pread(descriptor_.get(), into.data(), into.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw InputError(name_ + ": cannot be read to its end; check the disk");
    into = into.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

ByteBuffer RecordingFile::read(std::uint64_t offset, std::size_t count) const {
  ByteBuffer buffer(count);
  read(offset, {buffer.data(), count});
  return buffer;
}

}  // namespace roslam
