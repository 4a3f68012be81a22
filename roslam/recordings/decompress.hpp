// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "roslam/recordings/recording_file.hpp"

namespace roslam {

/// How the chunks and messages of recordings are compressed. LZ4 is its frame format.
enum class Compression { kNone, kLz4, kBz2, kZstd };

/// The method that a file calls by this name ("", "none", "lz4", "bz2", "zstd").
std::optional<Compression> compression_named(std::string_view name);

/// Throws InputError naming the file and the package if this library was built without the method.
void require_compression(Compression method, const std::string& file);

/// True if so many packed bytes may give so many bytes: within kMaxChunkBytes and what the method can reach.
/// To be asked before memory is allocated.
bool is_plausible_size(Compression method, std::uint64_t packed, std::uint64_t unpacked);

/// Unpacks bytes (not kNone) that give exactly size bytes; nothing if they are damaged. The size must be
/// plausible. is_truncated: the end of packed is missing; the result is what its beginning gives. Throws
/// InputError as require_compression does.
std::optional<ByteBuffer> decompress(Compression method, ByteSpan packed, std::size_t size, bool is_truncated,
                                     const std::string& file);

/// True if the bytes begin as a frame of Zstandard.
bool is_zstd_frame(ByteSpan bytes);

/// Unpacks one frame of Zstandard, which states its size; nothing if it is damaged or does not.
std::optional<ByteBuffer> decompress_zstd_frame(ByteSpan packed, const std::string& file);

}  // namespace roslam
