// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/compress.hpp"

#ifdef ROSLAM_WITH_LZ4
#include <lz4frame.h>
#endif
#ifdef ROSLAM_WITH_ZSTD
#include <zstd.h>
#endif

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
#ifdef ROSLAM_WITH_ZSTD
std::string zstd(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  constexpr int kFastest = 1;
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kFastest);
  if (ZSTD_isError(size) != 0) throw InputError(std::string("Zstandard: ") + ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}
#endif

#ifdef ROSLAM_WITH_LZ4
std::string lz4(std::string_view bytes) {
  std::string packed(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
  const std::size_t size =
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr);
  if (LZ4F_isError(size) != 0) throw InputError(std::string("LZ4: ") + LZ4F_getErrorName(size));
  packed.resize(size);
  return packed;
}
#endif
}  // namespace

Compression fastest_compression() {
#if defined(ROSLAM_WITH_ZSTD)
  return Compression::kZstd;
#elif defined(ROSLAM_WITH_LZ4)
  return Compression::kLz4;
#else
  return Compression::kNone;
#endif
}

std::string_view mcap_name(Compression method) {
  if (method == Compression::kZstd) return "zstd";
  return method == Compression::kLz4 ? "lz4" : "";
}

std::string compress(Compression method, std::string_view bytes) {
  switch (method) {
    case Compression::kNone:
      return std::string(bytes);
#ifdef ROSLAM_WITH_LZ4
    case Compression::kLz4:
      return lz4(bytes);
#endif
#ifdef ROSLAM_WITH_ZSTD
    case Compression::kZstd:
      return zstd(bytes);
#endif
    default:
      throw InputError("this program was built without the compression that was asked for");
  }
}

}  // namespace roslam
