// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/recording_writer.hpp"

namespace roslam {

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

}  // namespace roslam
