// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/recordings/chunked_recording.hpp"
#include "roslam/recordings/message_unpacker.hpp"

namespace roslam {

/// An MCAP file. With the index in its summary section only what that leaves out is scanned (messages outside
/// chunks); without one, or where it is damaged, the whole file.
class McapFile : public ChunkedRecording {
 public:
  /// Throws InputError.
  explicit McapFile(const std::filesystem::path& path);

  std::optional<RecordedMessage> next() override;
  std::string container() const override { return "MCAP"; }

  static bool recognises(std::string_view first_bytes) {
    return first_bytes.starts_with(std::string_view("\x89MCAP0\r\n", 8));
  }

 private:
  struct Schema {
    std::string name;
    std::string definition;
  };
  // A part of the file that the index covers.
  struct Indexed {
    std::uint64_t begin;
    std::uint64_t end;
  };

  std::optional<PackedChunk> chunk_at(std::uint64_t offset) override;
  std::vector<Entry> list(ByteSpan records) override;

  std::optional<std::uint64_t> summary_offset();
  bool read_summary(std::uint64_t offset);
  bool add_schema(ByteSpan content);
  bool add_channel(ByteSpan content);
  bool add_indexed(ByteSpan content);
  bool add_counts(ByteSpan content);
  void forget_index();
  void scan_gaps();
  void scan(std::uint64_t begin, std::uint64_t end);

  std::map<std::uint16_t, Schema> schemas_;
  std::size_t schema_bytes_ = 0;
  std::vector<Indexed> indexed_;
  std::optional<std::uint32_t> expected_chunks_;  // by the statistics of the summary
  MessageUnpacker unpacker_;
};

}  // namespace roslam
