// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/ros_bag.hpp"

#include <algorithm>
#include <cstring>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kMaxHeader = 8192;  // of a record; holds the name of a topic at most
constexpr std::uint64_t kMaxIndexBytes = std::uint64_t{256} << 20;
constexpr const char* kDamagedRecord = "damaged record; what follows it was left out";
constexpr const char* kUndescribed = "message of a topic that the file does not describe, left out";

enum Operation : std::uint8_t {
  kMessage = 0x02,
  kBagHeader = 0x03,
  kIndex = 0x04,
  kChunk = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07
};

// The value of a field: u32 length, then name=value, one after another.
std::optional<std::string_view> field(std::string_view fields, std::string_view name) {
  while (fields.size() >= 4) {
    std::uint32_t size = 0;
    std::memcpy(&size, fields.data(), sizeof size);
    fields.remove_prefix(4);
    if (size > fields.size()) return std::nullopt;
    const std::string_view entry = fields.substr(0, size);
    if (entry.size() > name.size() && entry.starts_with(name) && entry[name.size()] == '=')
      return entry.substr(name.size() + 1);
    fields.remove_prefix(size);
  }
  return std::nullopt;
}

template <typename T>
std::optional<T> number(std::string_view fields, std::string_view name) {
  const auto bytes = field(fields, name);
  T value{};
  if (!bytes || bytes->size() != sizeof value) return std::nullopt;
  std::memcpy(&value, bytes->data(), sizeof value);
  return value;
}

// Seconds and nanoseconds, 32 bits each.
std::optional<std::int64_t> time(std::string_view fields, std::string_view name) {
  const auto bits = number<std::uint64_t>(fields, name);
  if (!bits) return std::nullopt;
  constexpr std::int64_t kSecond = 1000000000;
  return static_cast<std::int64_t>(*bits & 0xffffffff) * kSecond + static_cast<std::int64_t>(*bits >> 32);
}

// The next record of bytes, which are then without it; nothing if it is cut or none.
struct Record {
  std::string_view header;
  ByteSpan data;
};

std::optional<Record> take_record(ByteCursor& cursor) {
  Record record;
  record.header = cursor.text();
  record.data = cursor.take(cursor.get<std::uint32_t>());
  return cursor.ok() ? std::optional(record) : std::nullopt;
}

// A record of the file, without its data.
struct RecordHead {
  std::string_view header;  // valid until the next reading
  std::uint8_t operation = 0;
  std::uint64_t data = 0;  // offset in the file
  std::uint32_t data_size = 0;
  std::uint64_t end() const { return data + data_size; }
};

std::optional<RecordHead> head_at(RecordingFile& file, std::uint64_t offset) {
  ByteCursor cursor(file.view(offset, kMaxHeader));
  RecordHead head;
  head.header = cursor.text();
  head.data_size = cursor.get<std::uint32_t>();
  const auto operation = number<std::uint8_t>(head.header, "op");
  if (!cursor.ok() || !operation) return std::nullopt;
  head.operation = *operation;
  head.data = offset + cursor.at();
  return head;
}
}  // namespace

RosBag::RosBag(const std::filesystem::path& path) : ChunkedRecording(path) {
  const std::string_view magic = as_text(file_.view(0, kMagic.size()));
  if (magic != kMagic) {
    throw InputError(file_.name() + (recognises(magic) && magic.size() == kMagic.size()
                                         ? ": a ROS 1 bag of an old version; convert it with rosbag fix"
                                         : ": not a ROS 1 bag, or truncated; give another file"));
  }
  const auto offset = index_offset();
  if (!offset || !read_index(*offset)) scan();
  finish_opening();
}

// Where the index is, or nothing with a note if there is none.
std::optional<std::uint64_t> RosBag::index_offset() {
  const auto head = head_at(file_, kMagic.size());
  if (!head || head->operation != kBagHeader) {
    note("damaged bag header; the file was scanned");
    return std::nullopt;
  }
  if (const auto encryptor = field(head->header, "encryptor"); encryptor && !encryptor->empty())
    throw InputError(file_.name() + ": is encrypted; decrypt it with rosbag decrypt");
  const std::uint64_t offset = number<std::uint64_t>(head->header, "index_pos").value_or(0);
  expected_connections_ = number<std::uint32_t>(head->header, "conn_count").value_or(0);
  expected_chunks_ = number<std::uint32_t>(head->header, "chunk_count").value_or(0);
  if (offset == 0) {
    note("the recording was not closed, it has no index; the file was scanned");
    return std::nullopt;
  }
  if (offset > file_.size() || (offset == file_.size() && expected_connections_ + expected_chunks_ > 0)) {
    note("the file is truncated, without its index; it was scanned");
    return std::nullopt;
  }
  return offset;
}

// The connections and chunks as the index lists them; false, with a note, if it is damaged.
bool RosBag::read_index(std::uint64_t offset) {
  const std::uint64_t size = file_.size() - offset;
  bool is_whole = size <= kMaxIndexBytes;
  const ByteBuffer bytes = is_whole ? file_.read(offset, static_cast<std::size_t>(size)) : ByteBuffer();
  ByteCursor cursor(bytes.span());
  std::uint32_t connections = 0;
  std::uint32_t chunks = 0;
  while (is_whole && cursor.left() > 0) {
    const auto record = take_record(cursor);
    const auto operation = record ? number<std::uint8_t>(record->header, "op") : std::nullopt;
    if (operation == kConnection) {
      is_whole = add_connection(record->header, record->data);
      ++connections;
    } else if (operation == kChunkInfo) {
      is_whole = add_indexed(record->header, record->data);
      ++chunks;
    } else {
      is_whole = false;
    }
  }
  if (is_whole && connections >= expected_connections_ && chunks >= expected_chunks_) return true;
  note("damaged index; the file was scanned");
  clear_chunks();
  topics_ = TopicTable(file_.name());
  return false;
}

bool RosBag::add_indexed(std::string_view header, ByteSpan data) {
  const auto offset = number<std::uint64_t>(header, "chunk_pos");
  const auto first = time(header, "start_time");
  const auto last = time(header, "end_time");
  const auto count = number<std::uint32_t>(header, "count");
  if (!offset || !first || !last || !count || *offset >= file_.size()) return false;
  Chunk chunk;
  chunk.offset = *offset;
  chunk.first = *first;
  chunk.last = *last;
  chunk.topics.emplace();
  ByteCursor counts(data);
  for (std::uint32_t i = 0; i < *count && counts.ok(); ++i) {
    const auto topic = topics_.of(counts.get<std::uint32_t>());
    const auto messages = counts.get<std::uint32_t>();
    if (!counts.ok() || !topic) return false;
    topics_.count(*topic, messages);
    chunk.topics->push_back(*topic);
  }
  if (counts.ok() && *count > 0) add(std::move(chunk));
  return counts.ok();
}

// The data of a connection are fields as those of its header.
bool RosBag::add_connection(std::string_view header, ByteSpan data) {
  const std::string_view fields = as_text(data);
  const auto channel = number<std::uint32_t>(header, "conn");
  const auto name = field(header, "topic");
  const auto type = field(fields, "type");
  if (!channel || !name || !type) return false;
  RecordedTopic topic;
  topic.name = *name;
  topic.type = *type;
  topic.encoding = "ros1";
  topic.definition = field(fields, "message_definition").value_or("");
  topic.messages = 0;
  topics_.assign(*channel, topics_.add(std::move(topic)));
  return true;
}

// Goes through the whole file.
void RosBag::scan() {
  std::uint64_t at = kMagic.size();
  std::uint64_t run = at;  // messages outside chunks begin here
  const auto end_run = [&] {
    if (at > run) add_unindexed(run, static_cast<std::size_t>(at - run));
  };
  while (at < file_.size()) {
    const auto head = head_at(file_, at);
    if (!head || head->end() > file_.size()) {
      const bool is_cut = head ? true : file_.size() - at < kMaxHeader;
      note(is_cut ? "the file is truncated" : kDamagedRecord);
      end_run();
      if (head && head->operation == kChunk) add_unindexed(at, 0);
      return;
    }
    const bool is_of_run = head->operation == kMessage || head->operation == kConnection;
    if (!is_of_run || head->end() - run > kRunBytes) {
      end_run();
      run = at;
    }
    const std::uint64_t end = head->end();
    if (head->operation == kChunk) add_unindexed(at, 0);
    if (end - at > kMaxChunkBytes && is_of_run) note("message with an implausible size, left out");
    if (end - at > kMaxChunkBytes || !is_of_run) run = end;
    at = end;
  }
  end_run();
}

std::optional<ChunkedRecording::PackedChunk> RosBag::chunk_at(std::uint64_t offset) {
  const auto head = head_at(file_, offset);
  const auto name = head ? field(head->header, "compression") : std::nullopt;
  const auto size = head ? number<std::uint32_t>(head->header, "size") : std::nullopt;
  const auto method = name ? compression_named(*name) : std::nullopt;
  if (!method || !size || head->operation != kChunk) {
    note(kDamagedChunk);
    return std::nullopt;
  }
  return PackedChunk{*method, head->data, head->data_size, *size, 0};
}

std::vector<ChunkedRecording::Entry> RosBag::list(ByteSpan records) {
  std::vector<Entry> messages;
  ByteCursor cursor(records);
  while (cursor.left() > 0) {
    const auto record = take_record(cursor);
    if (!record) {
      note(kCutChunk);
      break;
    }
    const auto operation = number<std::uint8_t>(record->header, "op");
    if (operation == kConnection && is_opening()) {
      if (!add_connection(record->header, record->data)) note("damaged connection, left out");
      continue;
    }
    if (operation != kMessage) continue;
    const auto channel = number<std::uint32_t>(record->header, "conn");
    const auto when = time(record->header, "time");
    const auto topic = channel ? topics_.of(*channel) : std::nullopt;
    if (!when || !topic) {
      note(kUndescribed);
      continue;
    }
    messages.push_back(
        {*when, cursor.at() - record->data.size(), static_cast<std::uint32_t>(record->data.size()), *topic});
  }
  return messages;
}

}  // namespace roslam
