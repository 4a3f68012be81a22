// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "roslam/recordings/decompress.hpp"

namespace roslam {

/// The fastest lossless method that was built in: Zstandard, else LZ4, else kNone.
Compression fastest_compression();

/// The name of a method in MCAP files: "zstd", "lz4", or "" for none.
std::string_view mcap_name(Compression method);

/// Packs bytes at the method's fastest level. Throws InputError if the method was not built in, or is none of
/// those of mcap_name().
std::string compress(Compression method, std::string_view bytes);

}  // namespace roslam
