// SPDX-License-Identifier: BSD-3-Clause
// The index of an MCAP file: its summary section.
#include <zlib.h>

#include "roslam/recordings/mcap.hpp"
#include "roslam/recordings/mcap_records.hpp"

namespace roslam {

using namespace mcap;

namespace {
constexpr std::uint64_t kMaxSummaryBytes = std::uint64_t{256} << 20;
}  // namespace

// Where the summary section begins, by the footer; nothing, with a note, if there is none or it is damaged.
std::optional<std::uint64_t> McapFile::summary_offset() {
  const std::uint64_t size = file_.size();
  if (size < 2 * kMagic + kFooter || !recognises(as_text(file_.view(size - kMagic, kMagic)))) {
    note("the file is truncated or was not closed, without its index; it was scanned");
    return std::nullopt;
  }
  const std::uint64_t footer = size - kMagic - kFooter;
  ByteCursor cursor(file_.view(footer, kFooter));
  const auto operation = cursor.get<std::uint8_t>();
  const auto length = cursor.get<std::uint64_t>();
  const auto offset = cursor.get<std::uint64_t>();
  cursor.get<std::uint64_t>();  // of the groups of the summary
  const auto crc = cursor.get<std::uint32_t>();
  if (offset == 0 && operation == kFooterRecord) {
    note("the file has no summary section; it was scanned");
    return std::nullopt;
  }
  bool is_whole = operation == kFooterRecord && length == kFooter - kHead && offset >= kMagic &&
                  offset <= footer && footer - offset <= kMaxSummaryBytes;
  if (is_whole && crc != 0) {
    const std::uint64_t covered = footer + kFooter - sizeof crc - offset;
    const ByteBuffer bytes = file_.read(offset, static_cast<std::size_t>(covered));
    is_whole = crc == crc32_z(0, bytes.span().data(), bytes.size());
  }
  if (!is_whole) note("damaged summary section; the file was scanned");
  return is_whole ? std::optional(offset) : std::nullopt;
}

// Channels and chunks as the summary lists them; false if it does not list all.
bool McapFile::read_summary(std::uint64_t offset) {
  const std::uint64_t footer = file_.size() - kMagic - kFooter;
  const ByteBuffer bytes = file_.read(offset, static_cast<std::size_t>(footer - offset));
  ByteCursor cursor(bytes.span());
  bool is_whole = true;
  ByteSpan statistics;
  std::vector<ByteSpan> chunks;
  while (is_whole && cursor.left() > 0) {
    const auto record = take_record(cursor);
    if (!record) {
      is_whole = false;
    } else if (record->operation == kSchema) {
      is_whole = add_schema(record->content);
    } else if (record->operation == kChannel) {
      is_whole = add_channel(record->content);
    } else if (record->operation == kChunkIndex) {
      chunks.push_back(record->content);
    } else if (record->operation == kStatistics) {
      statistics = record->content;
    }
  }
  for (const ByteSpan content : chunks) is_whole = is_whole && add_indexed(content);
  is_whole = is_whole && add_counts(statistics) && expected_chunks_ == chunks.size();
  is_counted_ = is_whole;
  if (is_whole) indexed_.push_back({offset, file_.size()});
  if (!is_whole) note("the summary section does not list all chunks and channels; the file was scanned");
  return is_whole;
}

void McapFile::forget_index() {
  clear_chunks();
  indexed_.clear();
  topics_ = TopicTable(file_.name());
}

// first and last time, offset and length of the chunk, offsets of its message indexes by channel, their
// length, compression, packed and unpacked size
bool McapFile::add_indexed(ByteSpan content) {
  ByteCursor cursor(content);
  const auto first = signed_time(cursor.get<std::uint64_t>());
  const auto last = signed_time(cursor.get<std::uint64_t>());
  Chunk chunk;
  chunk.offset = cursor.get<std::uint64_t>();
  const auto length = cursor.get<std::uint64_t>();
  ByteCursor channels(cursor.take(cursor.get<std::uint32_t>()));
  const auto index_length = cursor.get<std::uint64_t>();
  cursor.text();  // the compression, which a chunk says for itself, and may differ
  if (!cursor.ok() || !first || !last || chunk.offset >= file_.size() ||
      length > file_.size() - chunk.offset || index_length > file_.size() - chunk.offset - length)
    return false;
  chunk.first = *first;
  chunk.last = *last;
  if (index_length > 0) chunk.topics.emplace();
  while (channels.left() > 0) {
    const auto topic = topics_.of(channels.get<std::uint16_t>());
    channels.get<std::uint64_t>();
    if (!channels.ok() || !topic) return false;
    if (chunk.topics) chunk.topics->push_back(*topic);
  }
  indexed_.push_back({chunk.offset, chunk.offset + length + index_length});
  const bool is_empty = chunk.first == 0 && chunk.last == 0 && chunk.topics && chunk.topics->empty();
  if (!is_empty) add(std::move(chunk));
  return true;
}

// numbers of messages, schemas, channels, attachments, metadata and chunks, times, messages by channel
bool McapFile::add_counts(ByteSpan content) {
  ByteCursor cursor(content);
  cursor.take(8 + 2 + 4 + 4 + 4);
  expected_chunks_ = cursor.get<std::uint32_t>();
  cursor.take(8 + 8);
  ByteCursor counts(cursor.take(cursor.get<std::uint32_t>()));
  if (!cursor.ok()) return false;
  while (counts.left() > 0) {
    const auto topic = topics_.of(counts.get<std::uint16_t>());
    const auto messages = counts.get<std::uint64_t>();
    if (!counts.ok() || !topic) return false;
    topics_.count(*topic, static_cast<std::size_t>(messages));
  }
  return true;
}

}  // namespace roslam
