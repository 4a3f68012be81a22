// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/binary.hpp"

#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMagic = 8;
constexpr std::size_t kHeader = kMagic + 4 + 8 + 4;

std::uint32_t crc(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<z_size_t>(bytes.size())));
}

std::string megabytes(std::uintmax_t bytes) { return std::to_string(bytes / (1024 * 1024)) + " MB"; }

// left: number of bytes after the header. Returns the checksum that the content must have.
std::uint32_t check_header(std::string_view bytes, std::size_t left, const BinaryFormat& format,
                           const std::string& name) {
  if (bytes.empty()) throw InputError(name + ": empty; give the path of " + std::string(format.what));
  if (bytes.substr(0, kMagic) != format.magic.substr(0, std::min(bytes.size(), kMagic))) {
    throw InputError(name + ": not " + std::string(format.what) + " of RO-SLAM; give another file");
  }
  BinaryReader header(bytes, name);
  header.get_bytes(kMagic);
  const std::uint32_t oldest = format.oldest != 0 ? format.oldest : format.version;
  if (const auto version = header.get<std::uint32_t>(); version < oldest || version > format.version) {
    throw InputError(name + ": written in version " + std::to_string(version) + " of the format, this " +
                     "program reads version " + std::to_string(format.version) +
                     "; make it again with this program");
  }
  const auto size = header.get<std::uint64_t>();
  const auto expected = header.get<std::uint32_t>();
  if (size != left) header.fail("it is not as long as it should be");
  return expected;
}
}  // namespace

std::string_view BinaryReader::get_bytes(std::size_t count) {
  if (count > left()) fail("it ends too early");
  const std::string_view result = bytes_.substr(at_, count);
  at_ += count;
  return result;
}

std::string_view BinaryReader::get_text() { return get_bytes(get_count(1)); }

std::size_t BinaryReader::get_count(std::size_t bytes_each) {
  const auto count = static_cast<std::size_t>(get<std::uint32_t>());
  if (count > left() / bytes_each) fail("it declares more items than it contains");
  return count;
}

void BinaryReader::fail(const std::string& why) const {
  throw InputError(name_ + ": damaged, " + why + "; create or download it again");
}

void write_binary(const std::filesystem::path& file, const BinaryFormat& format, std::string_view content) {
  if (content.size() > format.max_bytes) {
    throw OutputError(file.string() + ": would have " + megabytes(content.size()) + ", more than " +
                      std::string(format.what) + " may have (" + megabytes(format.max_bytes) + ")");
  }
  BinaryWriter whole;
  whole.put_bytes(format.magic);
  whole.put(format.version);
  whole.put(static_cast<std::uint64_t>(content.size()));
  whole.put(crc(content));
  whole.put_bytes(content);
  replace_file(file, whole.bytes());
}

std::string read_binary(const std::filesystem::path& file, const BinaryFormat& format) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputError(file.string() + ": no such file; give the path of " + std::string(format.what));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) throw InputError(file.string() + ": cannot be read (" + error.message() + ")");
  if (size > format.max_bytes + kHeader) {
    throw InputError(file.string() + ": " + megabytes(size) + ", more than " + std::string(format.what) +
                     " may have (" + megabytes(format.max_bytes) + "); give another file");
  }
  std::ifstream in(file, std::ios::binary);
  std::string bytes;
  const auto read_up_to = [&](std::size_t end) {
    const std::size_t begin = bytes.size();
    bytes.resize(end);
    in.read(bytes.data() + begin, static_cast<std::streamsize>(end - begin));
    if (!in) throw InputError(file.string() + ": cannot be read; check its permissions and the disk");
  };
  // The header first, so that a large file of another format is rejected without reading it all.
  read_up_to(std::min<std::size_t>(size, kHeader));
  check_header(bytes, size - bytes.size(), format, file.string());
  read_up_to(size);
  check_binary(bytes, format, file.string());
  bytes.erase(0, kHeader);
  return bytes;
}

std::string_view check_binary(std::string_view bytes, const BinaryFormat& format, const std::string& name) {
  const std::size_t header = std::min(bytes.size(), kHeader);
  const std::uint32_t expected = check_header(bytes, bytes.size() - header, format, name);
  const std::string_view content = bytes.substr(header);
  if (crc(content) != expected) BinaryReader(content, name).fail("its checksum does not match");
  return content;
}

}  // namespace roslam
