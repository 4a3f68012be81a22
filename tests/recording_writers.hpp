// SPDX-License-Identifier: BSD-3-Clause
// Writers of ROS 1 bags, MCAP files and rosbag2 SQLite files, for tests: written from the specifications,
// independent of the readers. A writer that is destroyed without close() leaves a file as a crash does.
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/binary.hpp"

namespace roslam {

/// What the three writers have in common.
class RecordingWriter {
 public:
  virtual ~RecordingWriter() = default;

  /// Describes a topic; returns its id for write().
  virtual int add_topic(const std::string& name, const std::string& type, const std::string& definition) = 0;

  /// time: nanoseconds; in any order.
  virtual void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) = 0;

  /// Writes the index.
  virtual void close() = 0;
};

/// method: "none", "lz4", "bz2" or "zstd".
inline std::string compressed(const std::string& method, const std::string& bytes) {
  std::string packed;
  std::size_t size = 0;
  if (method == "lz4") {
    LZ4F_preferences_t preferences{};  // as ROS 1 needs them
    preferences.frameInfo.blockMode = LZ4F_blockIndependent;
    preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
    packed.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    size = LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
  } else if (method == "zstd") {
    packed.resize(ZSTD_compressBound(bytes.size()));
    size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1);
  } else if (method == "bz2") {
    packed.resize(bytes.size() + bytes.size() / 100 + 600);
    auto length = static_cast<unsigned>(packed.size());
    std::string source = bytes;
    if (BZ2_bzBuffToBuffCompress(packed.data(), &length, source.data(), static_cast<unsigned>(source.size()),
                                 1, 0, 0) != BZ_OK)
      throw std::runtime_error("bz2 failed");
    size = length;
  } else {
    return bytes;
  }
  packed.resize(size);
  return packed;
}

struct ChunkOptions {
  std::string compression = "none";
  std::size_t chunk_bytes = 768 * 1024;  ///< of records, after which a chunk ends by itself
};

/// A ROS 1 bag of version 2.0.
class BagWriter : public RecordingWriter {
 public:
  using Options = ChunkOptions;

  explicit BagWriter(const std::filesystem::path& file, Options options = {})
      : out_(file, std::ios::binary), options_(std::move(options)) {
    out_ << "#ROSBAG V2.0\n" << bag_header(0);
  }

  int add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    const auto id = static_cast<std::uint32_t>(connections_.size());
    const std::string data = field("topic", name) + field("type", type) +
                             field("md5sum", "d41d8cd98f00b204e9800998ecf8427e") +
                             field("message_definition", definition);
    connections_.push_back(record(field("conn", id) + field("op", '\x07') + field("topic", name), data));
    return static_cast<int>(id);
  }

  void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) override {
    const auto id = static_cast<std::uint32_t>(topic);
    if (!index_.contains(id)) chunk_ += connections_.at(id);
    index_[id].emplace_back(time, chunk_.size());
    chunk_ += record(field("conn", id) + field("op", '\x02') + field("time", ros_time(time)),
                     {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    first_ = count_ == 0 ? time : std::min(first_, time);
    last_ = count_ == 0 ? time : std::max(last_, time);
    ++count_;
    if (chunk_.size() >= options_.chunk_bytes) end_chunk();
  }

  /// Ends the chunk; the next message begins a new one.
  void end_chunk() {
    if (count_ == 0) return;
    std::string counts;
    const auto position = static_cast<std::uint64_t>(out_.tellp());
    out_ << record(field("compression", options_.compression) + field("op", '\x05') +
                       field("size", static_cast<std::uint32_t>(chunk_.size())),
                   compressed(options_.compression, chunk_));
    for (const auto& [id, entries] : index_) {
      const auto number = static_cast<std::uint32_t>(entries.size());
      std::string data;
      for (const auto& [time, offset] : entries)
        data += bits(ros_time(time)) + bits(static_cast<std::uint32_t>(offset));
      out_ << record(
          field("conn", id) + field("count", number) + field("op", '\x04') + field("ver", std::uint32_t{1}),
          data);
      counts += bits(id) + bits(number);
    }
    chunk_infos_.push_back(record(field("chunk_pos", position) +
                                      field("count", static_cast<std::uint32_t>(index_.size())) +
                                      field("end_time", ros_time(last_)) + field("op", '\x06') +
                                      field("start_time", ros_time(first_)) + field("ver", std::uint32_t{1}),
                                  counts));
    chunk_.clear();
    index_.clear();
    count_ = 0;
  }

  void close() override {
    end_chunk();
    const auto position = static_cast<std::uint64_t>(out_.tellp());
    for (const auto& connection : connections_) out_ << connection;
    for (const auto& info : chunk_infos_) out_ << info;
    out_.seekp(13);
    out_ << bag_header(position);
    out_.close();
  }

  template <BinaryValue T>
  static std::string bits(T value) {
    BinaryWriter writer;
    writer.put(value);
    return writer.bytes();
  }
  static std::string field(const std::string& name, const std::string& value) {
    return bits(static_cast<std::uint32_t>(name.size() + 1 + value.size())) + name + "=" + value;
  }
  template <BinaryValue T>
  static std::string field(const std::string& name, T value) {
    return field(name, bits(value));
  }
  static std::string record(const std::string& header, std::string_view data) {
    return bits(static_cast<std::uint32_t>(header.size())) + header +
           bits(static_cast<std::uint32_t>(data.size())) + std::string(data);
  }

 private:
  // Seconds in the lower 32 bits, nanoseconds in the upper ones.
  static std::uint64_t ros_time(std::int64_t time) {
    const auto whole = static_cast<std::uint64_t>(time);
    return whole / 1000000000 | whole % 1000000000 << 32U;
  }

  // Padded, so that it can be written again.
  std::string bag_header(std::uint64_t index) const {
    const std::string header = field("chunk_count", static_cast<std::uint32_t>(chunk_infos_.size())) +
                               field("conn_count", static_cast<std::uint32_t>(connections_.size())) +
                               field("index_pos", index) + field("op", '\x03');
    return record(header, std::string(4096 - 8 - header.size(), ' '));
  }

  std::ofstream out_;
  Options options_;
  std::vector<std::string> connections_;  // records
  std::vector<std::string> chunk_infos_;  // records
  std::string chunk_;
  std::map<std::uint32_t, std::vector<std::pair<std::int64_t, std::size_t>>> index_;  // of the chunk
  std::size_t count_ = 0;
  std::int64_t first_ = 0;
  std::int64_t last_ = 0;
};

struct McapOptions : ChunkOptions {
  McapOptions() = default;
  explicit McapOptions(const std::string& method) { compression = method; }
  bool has_chunks = true;   ///< else messages lie in the file itself
  bool has_summary = true;  ///< written by close()
  bool has_crcs = true;
};

/// An MCAP file, as rosbag2 writes it.
class McapWriter : public RecordingWriter {
 public:
  using Options = McapOptions;

  explicit McapWriter(const std::filesystem::path& file, Options options = {})
      : out_(file, std::ios::binary), options_(std::move(options)) {
    out_ << kMagic << record(0x01, text("ros2") + text("test"));
  }

  int add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    const auto id = static_cast<std::uint16_t>(channels_.size());
    const auto schema = static_cast<std::uint16_t>(id + 1);
    channels_.push_back(
        record(0x03, bits(schema) + text(type) + text("ros2msg") + text(definition)) +
        record(0x04, bits(id) + bits(schema) + text(name) + text("cdr") + bits(std::uint32_t{0})));
    counts_.push_back(0);
    return id;
  }

  void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) override {
    const auto id = static_cast<std::uint16_t>(topic);
    std::string records;
    if (counts_.at(id)++ == 0) records += channels_.at(id);
    const std::size_t offset = chunk_.size() + records.size();
    const auto stamp = static_cast<std::uint64_t>(time);
    records +=
        record(0x05, bits(id) + bits(static_cast<std::uint32_t>(counts_[id])) + bits(stamp) + bits(stamp) +
                         std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    first_of_all_ = std::min(first_of_all_, stamp);
    last_of_all_ = std::max(last_of_all_, stamp);
    if (!options_.has_chunks) {
      out_ << records;
      return;
    }
    chunk_ += records;
    first_ = index_.empty() ? stamp : std::min(first_, stamp);
    last_ = index_.empty() ? stamp : std::max(last_, stamp);
    index_[id] += bits(stamp) + bits(static_cast<std::uint64_t>(offset));
    if (chunk_.size() >= options_.chunk_bytes) end_chunk();
  }

  /// Ends the chunk; the next message begins a new one.
  void end_chunk() {
    if (index_.empty()) return;
    const std::string method = options_.compression == "none" ? "" : options_.compression;
    const std::string packed = compressed(options_.compression, chunk_);
    const auto position = static_cast<std::uint64_t>(out_.tellp());
    const std::string whole = record(0x06, bits(first_) + bits(last_) + bits(std::uint64_t{chunk_.size()}) +
                                               bits(options_.has_crcs ? crc(chunk_) : 0U) + text(method) +
                                               bits(std::uint64_t{packed.size()}) + packed);
    std::string indexes;
    std::string offsets;
    for (const auto& [id, entries] : index_) {
      offsets += bits(id) + bits(std::uint64_t{position + whole.size() + indexes.size()});
      indexes += record(0x07, bits(id) + text(entries));
    }
    out_ << whole << indexes;
    chunk_indexes_ +=
        record(0x08, bits(first_) + bits(last_) + bits(position) + bits(std::uint64_t{whole.size()}) +
                         text(offsets) + bits(std::uint64_t{indexes.size()}) + text(method) +
                         bits(std::uint64_t{packed.size()}) + bits(std::uint64_t{chunk_.size()}));
    ++chunks_;
    chunk_.clear();
    index_.clear();
  }

  void close() override {
    end_chunk();
    out_ << record(0x0f, bits(std::uint32_t{0}));
    const auto position = static_cast<std::uint64_t>(out_.tellp());
    std::string summary = options_.has_summary ? summary_records() : "";
    const std::uint64_t start = summary.empty() ? 0 : position;
    const std::string footer = '\x02' + bits(std::uint64_t{20}) + bits(start) + bits(std::uint64_t{0});
    out_ << summary << footer << bits(options_.has_crcs ? crc(summary + footer) : 0U) << kMagic;
    out_.close();
  }

  template <BinaryValue T>
  static std::string bits(T value) {
    return BagWriter::bits(value);
  }
  static std::string text(const std::string& bytes) {
    return bits(static_cast<std::uint32_t>(bytes.size())) + bytes;
  }
  static std::string record(std::uint8_t operation, const std::string& content) {
    return static_cast<char>(operation) + bits(std::uint64_t{content.size()}) + content;
  }

 private:
  static constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

  static std::uint32_t crc(const std::string& bytes) {
    return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  }

  std::string summary_records() const {
    std::string records;
    std::string counts;
    std::uint64_t messages = 0;
    for (std::size_t id = 0; id < channels_.size(); ++id) {
      records += channels_[id];
      counts += bits(static_cast<std::uint16_t>(id)) + bits(counts_[id]);
      messages += counts_[id];
    }
    const auto channels = static_cast<std::uint32_t>(channels_.size());
    records += record(0x0b, bits(messages) + bits(static_cast<std::uint16_t>(channels)) + bits(channels) +
                                bits(std::uint32_t{0}) + bits(std::uint32_t{0}) + bits(chunks_) +
                                bits(messages == 0 ? 0 : first_of_all_) + bits(last_of_all_) + text(counts));
    return records + chunk_indexes_;
  }

  std::ofstream out_;
  Options options_;
  std::vector<std::string> channels_;  // records of schema and channel
  std::vector<std::uint64_t> counts_;  // messages of each channel
  std::string chunk_;
  std::map<std::uint16_t, std::string> index_;  // of the chunk
  std::string chunk_indexes_;
  std::uint32_t chunks_ = 0;
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t first_of_all_ = ~std::uint64_t{0};
  std::uint64_t last_of_all_ = 0;
};

struct Db3Options {
  bool compresses_messages = false;  ///< each with zstd
  bool has_time_index = true;
  bool has_definitions = true;  ///< table of ROS 2 Iron and later
};

/// The SQLite file of rosbag2.
class Db3Writer : public RecordingWriter {
 public:
  using Options = Db3Options;

  explicit Db3Writer(const std::filesystem::path& file, Options options = {}) : options_(options) {
    std::filesystem::remove(file);
    sqlite3* opened = nullptr;
    const int state = sqlite3_open(file.c_str(), &opened);
    database_.reset(opened);
    if (state != SQLITE_OK) throw std::runtime_error("sqlite cannot open " + file.string());
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT "
        "NULL, "
        "data BLOB NOT NULL)");
    if (options_.has_time_index) run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    if (options_.has_definitions)
      run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT "
          "NOT "
          "NULL, encoded_message_definition TEXT NOT NULL)");
    run("BEGIN");
  }
  ~Db3Writer() override { insert_.reset(); }

  int add_topic(const std::string& name, const std::string& type, const std::string& definition) override {
    ++topics_;
    const Statement row = prepare("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')");
    sqlite3_bind_int(row.get(), 1, topics_);
    bind(row.get(), 2, name);
    bind(row.get(), 3, type);
    step(row.get());
    if (options_.has_definitions) {
      const Statement described = prepare("INSERT INTO message_definitions VALUES (?, ?, 'ros2msg', ?)");
      sqlite3_bind_int(described.get(), 1, topics_);
      bind(described.get(), 2, type);
      bind(described.get(), 3, definition);
      step(described.get());
    }
    return topics_;
  }

  void write(int topic, std::int64_t time, std::span<const std::uint8_t> bytes) override {
    if (!insert_) insert_ = prepare("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)");
    const std::string data = compressed(options_.compresses_messages ? "zstd" : "none",
                                        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    sqlite3_bind_int(insert_.get(), 1, topic);
    sqlite3_bind_int64(insert_.get(), 2, time);
    sqlite3_bind_blob(insert_.get(), 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    step(insert_.get());
    sqlite3_reset(insert_.get());
  }

  void close() override {
    run("COMMIT");
    insert_.reset();
    database_.reset();
  }

  /// Any SQL, for tests of unusual files.
  void run(const std::string& sql) {
    if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(database_.get()));
  }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
  };
  struct Finish {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finish>;

  Statement prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK)
      throw std::runtime_error(sql + ": " + sqlite3_errmsg(database_.get()));
    return Statement(statement);
  }
  static void bind(sqlite3_stmt* statement, int column, const std::string& text) {
    sqlite3_bind_text(statement, column, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  }
  void step(sqlite3_stmt* statement) {
    if (sqlite3_step(statement) != SQLITE_DONE) throw std::runtime_error(sqlite3_errmsg(database_.get()));
  }

  Options options_;
  std::unique_ptr<sqlite3, Close> database_;
  Statement insert_;
  int topics_ = 0;
};

}  // namespace roslam
