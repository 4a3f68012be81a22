// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/recordings/mcap_writer.hpp"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "roslam/common/binary.hpp"
#include "roslam/common/error.hpp"
#include "roslam/recordings/mcap_records.hpp"

namespace roslam {

namespace {
using namespace mcap;

constexpr std::size_t kIndexEntry = 8 + 8;  // time and offset of a message
constexpr std::string_view kMagicBytes{"\x89MCAP0\r\n", kMagic};

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// A record of the content that is written by a function.
template <typename Content>
std::string record(std::uint8_t operation, const Content& content) {
  BinaryWriter inner;
  content(inner);
  BinaryWriter outer;
  outer.put(operation);
  outer.put(std::uint64_t{inner.bytes().size()});
  outer.put_bytes(inner.bytes());
  return std::move(outer).bytes();
}

std::string beginning() {
  return std::string(kMagicBytes) + record(kHeader, [](BinaryWriter& out) {
           out.put_text("ros2");
           out.put_text("roslam");
         });
}

McapWriterOptions checked(const McapWriterOptions& options) {
  compress(options.compression, {});  // throws if it was not built in
  return options;
}
}  // namespace

void McapWriter::Times::add(std::uint64_t time) {
  first = std::min(first, time);
  last = std::max(last, time);
}

McapWriter::McapWriter(const std::filesystem::path& file, const McapWriterOptions& options)
    : options_(checked(options)), file_(file, beginning()), written_(beginning().size()) {}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (const std::exception&) {  // the file is readable without its end
  }
}

void McapWriter::fail() const {
  throw OutputError(file_.path().string() + ": cannot be written; is the disk full?");
}

int McapWriter::add_topic(const std::string& name, const std::string& type, const std::string& definition,
                          const std::map<std::string, std::string>& metadata) {
  const std::size_t id = topics_.size();
  if (id >= std::numeric_limits<std::uint16_t>::max()) throw UsageError("too many topics for an MCAP file");
  const auto [schema, is_new] = schemas_.try_emplace(type, static_cast<std::uint16_t>(schemas_.size() + 1));
  Topic topic;
  if (is_new) {
    topic.records = record(kSchema, [&](BinaryWriter& out) {
      out.put(schema->second);
      out.put_text(type);
      out.put_text("ros2msg");
      out.put_text(definition);
    });
  }
  topic.records += record(kChannel, [&](BinaryWriter& out) {
    out.put(static_cast<std::uint16_t>(id));
    out.put(schema->second);
    out.put_text(name);
    out.put_text("cdr");
    BinaryWriter pairs;
    for (const auto& [key, value] : metadata) {
      pairs.put_text(key);
      pairs.put_text(value);
    }
    out.put_text(pairs.bytes());
  });
  topics_.push_back(std::move(topic));
  return static_cast<int>(id);
}

void McapWriter::write(int topic, std::int64_t time, std::span<const std::uint8_t> message) {
  if (topic < 0 || static_cast<std::size_t>(topic) >= topics_.size() || is_closed_)
    throw UsageError("message for a topic that the MCAP file does not have");
  if (time < 0) throw UsageError("message of a negative time");
  const auto stamp = static_cast<std::uint64_t>(time);
  const bool is_old = chunk_times_.first <= stamp &&
                      stamp - chunk_times_.first > static_cast<std::uint64_t>(options_.chunk_time);
  if (is_old) end_chunk();
  Topic& written = topics_[static_cast<std::size_t>(topic)];
  if (!std::exchange(written.is_described, true)) chunk_ += written.records;
  BinaryWriter index;
  index.put(stamp);
  index.put(std::uint64_t{chunk_.size()});
  BinaryWriter head;
  head.put(std::uint8_t{kMessage});
  constexpr std::size_t kFields = 2 + 4 + 8 + 8;
  head.put(std::uint64_t{kFields + message.size()});
  head.put(static_cast<std::uint16_t>(topic));
  head.put(static_cast<std::uint32_t>(written.messages + written.index.size() / kIndexEntry));
  head.put(stamp);
  head.put(stamp);
  chunk_ += head.bytes();
  chunk_.append(reinterpret_cast<const char*>(message.data()), message.size());
  written.index += index.bytes();
  chunk_times_.add(stamp);
  if (chunk_.size() >= options_.chunk_bytes) end_chunk();
}

void McapWriter::end_chunk() {
  const std::string content = std::exchange(chunk_, {});
  const Times times = std::exchange(chunk_times_, {});
  std::vector<std::pair<std::uint16_t, std::string>> indexes;
  for (std::size_t id = 0; id < topics_.size(); ++id)
    if (!topics_[id].index.empty())
      indexes.emplace_back(static_cast<std::uint16_t>(id), std::exchange(topics_[id].index, {}));
  if (indexes.empty()) return;
  const std::string packed = compress(options_.compression, content);
  std::string bytes = record(kChunk, [&](BinaryWriter& out) {
    out.put(times.first);
    out.put(times.last);
    out.put(std::uint64_t{content.size()});
    out.put(crc_of(content));
    out.put_text(mcap_name(options_.compression));
    out.put(std::uint64_t{packed.size()});
    out.put_bytes(packed);
  });
  const std::uint64_t chunk_bytes = bytes.size();
  BinaryWriter offsets;
  for (const auto& [id, entries] : indexes) {
    offsets.put(id);
    offsets.put(written_ + bytes.size());
    bytes += record(kMessageIndex, [&, id = id, &entries = entries](BinaryWriter& out) {
      out.put(id);
      out.put_text(entries);
    });
  }
  const std::string index = record(kChunkIndex, [&](BinaryWriter& out) {
    out.put(times.first);
    out.put(times.last);
    out.put(written_);
    out.put(chunk_bytes);
    out.put_text(offsets.bytes());
    out.put(std::uint64_t{bytes.size()} - chunk_bytes);
    out.put_text(mcap_name(options_.compression));
    out.put(std::uint64_t{packed.size()});
    out.put(std::uint64_t{content.size()});
  });
  if (!file_.append(bytes)) {
    for (Topic& topic : topics_) topic.is_described = false;  // what described it may be lost
    fail();
  }
  written_ += bytes.size();
  chunk_indexes_ += index;
  for (const auto& [id, entries] : indexes) topics_[id].messages += entries.size() / kIndexEntry;
  times_.add(times.first);
  times_.add(times.last);
  ++chunks_;
}

std::string McapWriter::summary() const {
  std::string records;
  BinaryWriter counts;
  std::uint64_t messages = 0;
  for (std::size_t id = 0; id < topics_.size(); ++id) {
    records += topics_[id].records;
    counts.put(static_cast<std::uint16_t>(id));
    counts.put(topics_[id].messages);
    messages += topics_[id].messages;
  }
  records += record(kStatistics, [&](BinaryWriter& out) {
    out.put(messages);
    out.put(static_cast<std::uint16_t>(schemas_.size()));
    out.put(static_cast<std::uint32_t>(topics_.size()));
    out.put(std::uint32_t{0});  // attachments
    out.put(std::uint32_t{0});  // metadata
    out.put(chunks_);
    out.put(messages == 0 ? 0 : times_.first);
    out.put(times_.last);
    out.put_text(counts.bytes());
  });
  return records + chunk_indexes_;
}

void McapWriter::close() {
  if (std::exchange(is_closed_, true)) return;
  end_chunk();
  const std::string data_end = record(kDataEnd, [](BinaryWriter& out) { out.put(std::uint32_t{0}); });
  std::string end = summary();
  // The checksum covers the summary and the footer up to itself.
  BinaryWriter footer;
  footer.put(std::uint8_t{kFooterRecord});
  footer.put(std::uint64_t{kFooter - kHead});
  footer.put(written_ + data_end.size());
  footer.put(std::uint64_t{0});  // no summary offsets
  end += footer.bytes();
  BinaryWriter last;
  last.put(crc_of(end));
  last.put_bytes(kMagicBytes);
  const std::string bytes = data_end + end + last.bytes();
  if (!file_.append(bytes)) fail();
  written_ += bytes.size();
  sync();
}

void McapWriter::sync() {
  if (!file_.sync()) throw OutputError(file_.path().string() + ": the disk refused to keep it");
}

void McapWriter::flush() {
  end_chunk();
  sync();
}

}  // namespace roslam
