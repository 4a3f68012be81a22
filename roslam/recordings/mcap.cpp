// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/mcap.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"
#include "roslam/recordings/mcap_records.hpp"

namespace roslam {

using namespace mcap;

namespace {
constexpr std::size_t kMaxChunkHeader = 256;
constexpr std::size_t kMaxSchemaName = 1024;
constexpr std::size_t kMaxSchemaBytes = std::size_t{64} << 20;

bool is_of_run(std::uint8_t operation) {
  return operation == kSchema || operation == kChannel || operation == kMessage;
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
    if (!head || head->content > end || head->size > end - head->content) {
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
      note(kCutChunk);
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
