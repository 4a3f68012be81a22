// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/appended_file.hpp"
#include "roslam/common/export.hpp"
#include "roslam/recordings/compress.hpp"

namespace roslam {

struct McapWriterOptions {
  std::size_t chunk_bytes = 1U << 20U;      ///< of messages before compression, after which a chunk ends; > 0
  std::int64_t chunk_time = 1'000'000'000;  ///< ns of record time after which it ends as well; > 0
  Compression compression = fastest_compression();
};

/// Writes ROS 2 messages to an MCAP file (mcap.dev/spec, version 0), in chunks that are compressed each by
/// itself and have a checksum. A chunk is in the file as soon as it ends, so that of a program that is killed
/// only the last chunk is lost, and of a power cut what came after the last flush(); the file is then without
/// an index, and is read all the same. close() writes the index. For one thread at a time.
class ROSLAM_EXPORT McapWriter {
 public:
  /// Makes the file, in place of an older one. Throws OutputError, and InputError if the compression was not
  /// built in.
  explicit McapWriter(const std::filesystem::path& file, const McapWriterOptions& options = {});
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Describes a topic; returns its id. type: such as sensor_msgs/msg/Image; definition: as ros_definition()
  /// gives it; metadata: of the channel, such as offered_qos_profiles of rosbag2. Throws UsageError for more
  /// than 65535 topics.
  int add_topic(const std::string& name, const std::string& type, const std::string& definition,
                const std::map<std::string, std::string>& metadata = {});

  /// Appends a message in CDR. time: nanoseconds from 0, when it was recorded. Throws OutputError if the disk
  /// is full or fails; what was written before stays readable, and the message is lost. Throws UsageError for
  /// an id that add_topic() did not give, or a negative time.
  void write(int topic, std::int64_t time, std::span<const std::uint8_t> message);

  /// Ends the chunk and waits until all that was written is on the disk. Throws OutputError.
  void flush();

  /// Ends the file with the last chunk and the index. Throws OutputError. Called by the destructor, which
  /// swallows the error.
  void close();

  /// Bytes in the file.
  std::uint64_t bytes() const { return written_; }

 private:
  struct Topic {
    std::string records;         // schema and channel
    bool is_described = false;   // by a record in the chunk or in the file
    std::uint64_t messages = 0;  // in the file
    std::string index;           // of the chunk: time and offset of each message
  };
  struct Times {
    std::uint64_t first = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t last = 0;
    void add(std::uint64_t time);
  };

  [[noreturn]] void fail() const;
  void end_chunk();
  void sync();
  std::string summary() const;

  McapWriterOptions options_;
  AppendedFile file_;
  std::uint64_t written_ = 0;
  std::map<std::string, std::uint16_t> schemas_;  // by type
  std::vector<Topic> topics_;
  std::string chunk_;
  Times chunk_times_, times_;
  std::string chunk_indexes_;
  std::uint32_t chunks_ = 0;
  bool is_closed_ = false;
};

}  // namespace roslam
