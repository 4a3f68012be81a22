// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "roslam/recordings/decompress.hpp"

namespace roslam {

/// Unpacks messages that rosbag2 compressed one by one (compression_mode: message). A message in CDR never
/// begins like a frame of Zstandard, so that nothing else has to say so.
class MessageUnpacker {
 public:
  /// The message itself, valid until the next call; nothing if it is damaged. file: for messages.
  /// Throws InputError if this library was built without Zstandard.
  std::optional<ByteSpan> unpack(std::string_view encoding, ByteSpan data, const std::string& file) {
    if (encoding != "cdr" || !is_zstd_frame(data)) return data;
    auto unpacked = decompress_zstd_frame(data, file);
    if (!unpacked) return std::nullopt;
    unpacked_ = std::move(*unpacked);
    return unpacked_.span();
  }

 private:
  ByteBuffer unpacked_;
};

/// The note for a message that could not be unpacked.
constexpr const char* kDamagedMessage = "damaged compressed message, left out";

}  // namespace roslam
