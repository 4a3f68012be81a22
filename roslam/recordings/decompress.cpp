// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/decompress.hpp"

#ifdef ROSLAM_WITH_BZ2
#include <bzlib.h>
#endif
#ifdef ROSLAM_WITH_LZ4
#include <lz4frame.h>
#endif
#ifdef ROSLAM_WITH_ZSTD
#include <zstd.h>
#endif

#include <algorithm>
#include <array>
#include <memory>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
struct Method {
  Compression compression;
  std::string_view name;
  const char* package;
  bool is_built_in;
  std::uint64_t max_ratio;  // of unpacked to packed bytes: what the format can reach with one value repeated
};

#ifdef ROSLAM_WITH_LZ4
constexpr bool kHasLz4 = true;
#else
constexpr bool kHasLz4 = false;
#endif
#ifdef ROSLAM_WITH_BZ2
constexpr bool kHasBz2 = true;
#else
constexpr bool kHasBz2 = false;
#endif
#ifdef ROSLAM_WITH_ZSTD
constexpr bool kHasZstd = true;
#else
constexpr bool kHasZstd = false;
#endif

// LZ4: a byte of a match's length stands for 255. bz2: a block of 900 kB holds runs of 259 bytes in 5, and is
// itself packed into some 40 bytes. Zstandard: a block of 128 KiB in four bytes.
constexpr std::array<Method, 5> kMethods{{
    {Compression::kNone, "none", "", true, 1},
    {Compression::kNone, "", "", true, 1},
    {Compression::kLz4, "lz4", "liblz4-dev", kHasLz4, 256},
    {Compression::kBz2, "bz2", "libbz2-dev", kHasBz2, 2000000},
    {Compression::kZstd, "zstd", "libzstd-dev", kHasZstd, 65536},
}};

const Method& method_of(Compression compression) {
  return *std::find_if(kMethods.begin(), kMethods.end(),
                       [&](const Method& method) { return method.compression == compression; });
}

// Each fills a buffer and returns how many bytes came out, or nothing if the packed bytes are damaged.
using Produced = std::optional<std::size_t>;

#ifdef ROSLAM_WITH_LZ4
Produced unpack_lz4(ByteSpan packed, ByteBuffer& out, bool is_truncated) {
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION))) return std::nullopt;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      created, &LZ4F_freeDecompressionContext);
  std::size_t produced = 0;
  for (;;) {
    std::size_t room = out.size() - produced;
    std::size_t taken = packed.size();
    const std::size_t wanted =
        LZ4F_decompress(context.get(), out.data() + produced, &room, packed.data(), &taken, nullptr);
    if (LZ4F_isError(wanted)) return std::nullopt;
    produced += room;
    packed = packed.subspan(taken);
    if (wanted == 0) return produced;
    if (taken == 0 && room == 0) return is_truncated ? Produced(produced) : std::nullopt;
  }
}
#endif

#ifdef ROSLAM_WITH_BZ2
Produced unpack_bz2(ByteSpan packed, ByteBuffer& out, bool is_truncated) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return std::nullopt;
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end(&stream, &BZ2_bzDecompressEnd);
  // The interface takes a pointer to bytes that it does not change.
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(packed.data()));
  stream.avail_in = static_cast<unsigned>(packed.size());
  stream.next_out = reinterpret_cast<char*>(out.data());
  stream.avail_out = static_cast<unsigned>(out.size());
  for (;;) {
    const unsigned in = stream.avail_in;
    const unsigned room = stream.avail_out;
    const int state = BZ2_bzDecompress(&stream);
    if (state == BZ_STREAM_END) return out.size() - stream.avail_out;
    if (state != BZ_OK) return std::nullopt;
    if (stream.avail_in == in && stream.avail_out == room)
      return is_truncated ? Produced(out.size() - stream.avail_out) : std::nullopt;
  }
}
#endif

#ifdef ROSLAM_WITH_ZSTD
Produced unpack_zstd(ByteSpan packed, ByteBuffer& out, bool is_truncated) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return std::nullopt;
  if (!is_truncated) {  // at once: needs no buffer of the window's size besides
    const std::size_t produced =
        ZSTD_decompressDCtx(context.get(), out.data(), out.size(), packed.data(), packed.size());
    return ZSTD_isError(produced) ? std::nullopt : Produced(produced);
  }
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  ZSTD_outBuffer to{out.data(), out.size(), 0};
  for (;;) {
    const std::size_t taken = in.pos;
    const std::size_t produced = to.pos;
    const std::size_t wanted = ZSTD_decompressStream(context.get(), &to, &in);
    if (ZSTD_isError(wanted)) return std::nullopt;
    if (in.pos == taken && to.pos == produced) return to.pos;
  }
}
#endif

Produced unpack(Compression method, [[maybe_unused]] ByteSpan packed, [[maybe_unused]] ByteBuffer& out,
                [[maybe_unused]] bool is_truncated) {
  switch (method) {
#ifdef ROSLAM_WITH_LZ4
    case Compression::kLz4:
      return unpack_lz4(packed, out, is_truncated);
#endif
#ifdef ROSLAM_WITH_BZ2
    case Compression::kBz2:
      return unpack_bz2(packed, out, is_truncated);
#endif
#ifdef ROSLAM_WITH_ZSTD
    case Compression::kZstd:
      return unpack_zstd(packed, out, is_truncated);
#endif
    default:
      return std::nullopt;
  }
}
}  // namespace

std::optional<Compression> compression_named(std::string_view name) {
  for (const Method& method : kMethods) {
    if (method.name == name) return method.compression;
  }
  return std::nullopt;
}

void require_compression(Compression compression, const std::string& file) {
  const Method& method = method_of(compression);
  if (method.is_built_in) return;
  throw InputError(file + ": is compressed with " + std::string(method.name) +
                   ", which this program was built without; install " + method.package +
                   " and build it again");
}

bool is_plausible_size(Compression method, std::uint64_t packed, std::uint64_t unpacked) {
  constexpr std::uint64_t kSmall = 4096;  // frames of few bytes
  return packed <= kMaxChunkBytes && unpacked <= kMaxChunkBytes &&
         unpacked <= packed * method_of(method).max_ratio + (method == Compression::kNone ? 0 : kSmall);
}

std::optional<ByteBuffer> decompress(Compression method, ByteSpan packed, std::size_t size, bool is_truncated,
                                     const std::string& file) {
  require_compression(method, file);
  ByteBuffer out(size);
  const Produced produced = unpack(method, packed, out, is_truncated);
  if (!produced || *produced > size || (*produced < size && !is_truncated)) return std::nullopt;
  out.shorten(*produced);
  return out;
}

bool is_zstd_frame(ByteSpan bytes) { return as_text(bytes).starts_with("\x28\xb5\x2f\xfd"); }

std::optional<ByteBuffer> decompress_zstd_frame([[maybe_unused]] ByteSpan packed, const std::string& file) {
  require_compression(Compression::kZstd, file);
#ifdef ROSLAM_WITH_ZSTD
  // Unknown and damaged are the two largest values.
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (!is_plausible_size(Compression::kZstd, packed.size(), size)) return std::nullopt;
  return decompress(Compression::kZstd, packed, static_cast<std::size_t>(size), false, file);
#else
  return std::nullopt;
#endif
}

}  // namespace roslam
