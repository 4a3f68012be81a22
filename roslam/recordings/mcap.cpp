// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/mcap.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMagic = 8;
constexpr std::size_t kHead = 1 + 8;  // operation and size of a record
constexpr std::size_t kFooter = kHead + 8 + 8 + 4;
constexpr std::size_t kMaxChunkHeader = 256;
constexpr std::uint64_t kMaxSummaryBytes = std::uint64_t{256} << 20;
constexpr std::uint64_t kRunBytes = std::uint64_t{4}
                                    << 20;  // messages outside chunks that are loaded at once
constexpr std::size_t kMaxSchemaName = 1024;
constexpr std::size_t kMaxSchemaBytes = std::size_t{64} << 20;
constexpr const char* kDamagedChunk = "damaged chunk, left out";

enum Operation : std::uint8_t {
  kFooterRecord = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kDataEnd = 0x0f
};

bool is_of_run(std::uint8_t operation) {
  return operation == kSchema || operation == kChannel || operation == kMessage;
}

// Times are unsigned in the file; those that do not fit are none.
std::optional<std::int64_t> signed_time(std::uint64_t time) {
  if (time > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
  return static_cast<std::int64_t>(time);
}

struct Record {
  std::uint8_t operation = 0;
  ByteSpan content;
};

std::optional<Record> take_record(ByteCursor& cursor) {
  Record record;
  record.operation = cursor.get<std::uint8_t>();
  record.content = cursor.take(cursor.get<std::uint64_t>());
  return cursor.ok() ? std::optional(record) : std::nullopt;
}

// A record of the file, without its content.
struct RecordHead {
  std::uint8_t operation = 0;
  std::uint64_t content = 0;  // offset in the file
  std::uint64_t size = 0;
};

std::optional<RecordHead> head_at(RecordingFile& file, std::uint64_t offset) {
  ByteCursor cursor(file.view(offset, kHead));
  RecordHead head;
  head.operation = cursor.get<std::uint8_t>();
  head.size = cursor.get<std::uint64_t>();
  head.content = offset + kHead;
  return cursor.ok() ? std::optional(head) : std::nullopt;
}
}  // namespace

McapFile::McapFile(const std::filesystem::path& path) : ChunkedRecording(path) {
  if (!recognises(as_text(file_.view(0, kMagic))))
    throw InputError(file_.name() + ": not an MCAP file of version 0; give another file");
  const auto summary = summary_offset();
  if (!summary || !read_summary(*summary)) forget_index();
  scan_gaps();
  finish_opening();
}

std::optional<RecordedMessage> McapFile::next() {
  while (auto message = ChunkedRecording::next()) {
    const auto& encoding = topics()[static_cast<std::size_t>(message->topic)].encoding;
    if (const auto data = unpacker_.unpack(encoding, message->data, file_.name())) {
      message->data = *data;
      return message;
    }
    note(kDamagedMessage);
  }
  return std::nullopt;
}

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

// id, name, encoding, data
bool McapFile::add_schema(ByteSpan content) {
  ByteCursor cursor(content);
  const auto id = cursor.get<std::uint16_t>();
  Schema schema;
  schema.name = cursor.text();
  cursor.text();
  schema.definition = cursor.text();
  if (!cursor.ok() || id == 0 || schema.name.size() > kMaxSchemaName) return false;
  if (schemas_.contains(id)) return true;  // it may be repeated, not changed
  if (schema.definition.size() > kMaxSchemaBytes - schema_bytes_) schema.definition.clear();
  schema_bytes_ += schema.definition.size();
  schemas_.emplace(id, std::move(schema));
  return true;
}

// id, schema, topic, encoding of messages, metadata
bool McapFile::add_channel(ByteSpan content) {
  ByteCursor cursor(content);
  const auto id = cursor.get<std::uint16_t>();
  const auto schema = schemas_.find(cursor.get<std::uint16_t>());
  RecordedTopic topic;
  topic.name = cursor.text();
  topic.encoding = cursor.text();
  if (!cursor.ok()) return false;
  if (topics_.of(id)) return true;
  if (schema != schemas_.end()) {
    topic.type = schema->second.name;
    topic.definition = schema->second.definition;
  }
  topic.messages = 0;
  topics_.assign(id, topics_.add(std::move(topic)));
  return true;
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

// The parts of the file that the index does not cover, which may hold messages outside chunks.
void McapFile::scan_gaps() {
  std::sort(indexed_.begin(), indexed_.end(),
            [](const Indexed& a, const Indexed& b) { return a.begin < b.begin; });
  std::uint64_t at = kMagic;
  for (const Indexed& part : indexed_) {
    if (part.begin > at) scan(at, part.begin);
    at = std::max(at, part.end);
  }
  if (at < file_.size()) scan(at, file_.size());
}

void McapFile::scan(std::uint64_t begin, std::uint64_t end) {
  std::uint64_t at = begin;
  std::uint64_t run = at;  // messages outside chunks begin here
  const auto end_run = [&] {
    if (at > run) add_unindexed(run, static_cast<std::size_t>(at - run));
    run = at;
  };
  while (at < end) {
    const auto head = head_at(file_, at);
    if (!head || head->size > end - head->content) {
      note("the file is truncated or damaged; what follows was left out");
      end_run();
      if (head && head->operation == kChunk) add_unindexed(at, 0);
      return;
    }
    const std::uint64_t next = head->content + head->size;
    if (head->operation == kDataEnd || head->operation == kFooterRecord)
      break;  // what follows repeats what was
    if (!is_of_run(head->operation) || next - run > kRunBytes) end_run();
    if (head->operation == kChunk) add_unindexed(at, 0);
    const bool is_too_large = next - at > kMaxChunkBytes;
    if (is_too_large && is_of_run(head->operation)) note("message with an implausible size, left out");
    at = next;
    if (is_too_large || !is_of_run(head->operation)) run = at;
  }
  end_run();
}

// first and last time, unpacked size, CRC, compression, packed bytes
std::optional<ChunkedRecording::PackedChunk> McapFile::chunk_at(std::uint64_t offset) {
  ByteCursor cursor(file_.view(offset, kMaxChunkHeader));
  const auto operation = cursor.get<std::uint8_t>();
  cursor.take(8 + 8 + 8);
  PackedChunk chunk;
  chunk.unpacked = cursor.get<std::uint64_t>();
  chunk.crc = cursor.get<std::uint32_t>();
  const auto method = compression_named(cursor.text());
  chunk.packed = cursor.get<std::uint64_t>();
  chunk.offset = offset + cursor.at();
  if (!cursor.ok() || operation != kChunk || !method) {
    note(kDamagedChunk);
    return std::nullopt;
  }
  chunk.method = *method;
  return chunk;
}

// A message: channel, number, time it was recorded, time it was sent, data.
std::vector<ChunkedRecording::Entry> McapFile::list(ByteSpan records) {
  std::vector<Entry> messages;
  ByteCursor cursor(records);
  while (cursor.left() > 0) {
    const auto record = take_record(cursor);
    if (!record) {
      note("cut or damaged record; the rest of its chunk was left out");
      break;
    }
    if (is_opening() && record->operation == kSchema && !add_schema(record->content))
      note("damaged schema, left out");
    if (is_opening() && record->operation == kChannel && !add_channel(record->content))
      note("damaged channel, left out");
    if (record->operation != kMessage) continue;
    ByteCursor message(record->content);
    const auto topic = topics_.of(message.get<std::uint16_t>());
    message.get<std::uint32_t>();
    const auto when = signed_time(message.get<std::uint64_t>());
    message.get<std::uint64_t>();
    if (!message.ok() || !topic || !when) {
      note("message without a time, or of a channel that the file does not describe, left out");
      continue;
    }
    messages.push_back(
        {*when, cursor.at() - message.left(), static_cast<std::uint32_t>(message.left()), *topic});
  }
  return messages;
}

}  // namespace roslam
