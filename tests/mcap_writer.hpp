// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/recording_writer.hpp"

namespace roslam {

struct TestMcapOptions : ChunkOptions {
  TestMcapOptions() = default;
  explicit TestMcapOptions(const std::string& method) { compression = method; }
  bool has_chunks = true;   ///< else messages lie in the file itself
  bool has_summary = true;  ///< written by close()
  bool has_crcs = true;
};

/// An MCAP file, as rosbag2 writes it.
class TestMcapWriter : public RecordingWriter {
 public:
  using Options = TestMcapOptions;

  explicit TestMcapWriter(const std::filesystem::path& file, Options options = {})
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

}  // namespace roslam
