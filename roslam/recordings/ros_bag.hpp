// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/recordings/chunked_recording.hpp"

namespace roslam {

/// A ROS 1 bag of version 2.0, with its index, or scanned where it has none (the recording was cut).
class RosBag : public ChunkedRecording {
 public:
  /// Throws InputError.
  explicit RosBag(const std::filesystem::path& path);

  std::string container() const override { return "ROS 1 bag"; }

  /// True if a file begins like a ROS 1 bag of any version.
  static bool recognises(std::string_view first_bytes) { return first_bytes.starts_with("#ROS"); }

 private:
  std::optional<PackedChunk> chunk_at(std::uint64_t offset) override;
  std::vector<Entry> list(ByteSpan records) override;

  std::optional<std::uint64_t> index_offset();
  bool read_index(std::uint64_t offset);
  bool add_indexed(std::string_view header, ByteSpan data);
  bool add_connection(std::string_view header, ByteSpan data);
  void scan();

  std::uint32_t expected_connections_ = 0;  // that the index should have
  std::uint32_t expected_chunks_ = 0;
};

}  // namespace roslam
