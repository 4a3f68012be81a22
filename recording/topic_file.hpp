// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "roslam/recordings/mcap_writer.hpp"
#include "roslam/ros/ros_encoding.hpp"

namespace roslam::recording {

struct TopicDescription {
  std::string name;         ///< such as /path
  std::string type;         ///< such as nav_msgs/msg/Path
  bool is_latched = false;  ///< who subscribes late receives the last message (durability transient_local)
};

/// An MCAP file that is there in whole or not at all: it is written beside its place (.part) and renamed. A
/// topic is in the file once it has a message. For one thread at a time.
class TopicFile {
 public:
  struct Topic {
    std::string name, type;
    std::size_t messages = 0;
    std::uint64_t bytes = 0;  ///< of its messages, before compression
  };

  /// Throws OutputError.
  explicit TopicFile(const std::filesystem::path& file);
  /// Removes what was written, unless finish() was called.
  ~TopicFile();
  TopicFile(const TopicFile&) = delete;
  TopicFile& operator=(const TopicFile&) = delete;

  /// Appends a message, which is recorded at its stamp (ns). Throws OutputError.
  void write(const TopicDescription& topic, std::int64_t stamp, const RosMessage& message);

  /// Puts the file in its place. Throws OutputError; an older file is as before then.
  void finish();

  /// In the order of their first messages.
  const std::vector<Topic>& topics() const { return topics_; }
  std::uint64_t bytes() const { return bytes_; }  ///< of the file; after finish()
  /// Stamps of the earliest and the latest message, if there is one.
  std::optional<std::pair<std::int64_t, std::int64_t>> time_range() const { return time_range_; }

 private:
  std::filesystem::path file_, part_;
  std::optional<McapWriter> writer_;
  std::vector<Topic> topics_;               // by the writer's id
  std::map<std::string, std::size_t> ids_;  // by name
  std::optional<std::pair<std::int64_t, std::int64_t>> time_range_;
  std::uint64_t bytes_ = 0;
};

}  // namespace roslam::recording
