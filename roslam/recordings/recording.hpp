// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// A topic of a recording, with the type of its messages.
struct RecordedTopic {
  int id = 0;                           ///< its index in Recording::topics()
  std::string name;                     ///< such as /camera/color/image_raw
  std::string type;                     ///< ROS 1: "sensor_msgs/Image"; ROS 2: "sensor_msgs/msg/Image"
  std::string encoding;                 ///< "ros1", "cdr", or what the file says
  std::string definition;               ///< message definition as in the file; may be empty
  std::optional<std::size_t> messages;  ///< how many, where the index of the file or a scan says so
};

/// A message of a recording.
struct RecordedMessage {
  int topic = 0;                       ///< RecordedTopic::id
  std::int64_t time = 0;               ///< nanoseconds, when it was recorded; the zero is the recorder's
  std::span<const std::uint8_t> data;  ///< valid until the next call of next() or select()
};

/// A file, or folder of files, in which a robot recorded messages: a ROS 1 bag, a rosbag2 SQLite file or an
/// MCAP file. Messages that several publishers sent to one topic are of one RecordedTopic. Memory does not
/// grow with the file, apart from its index: only chunks whose times overlap are held. For one thread at a
/// time.
class ROSLAM_EXPORT Recording {
 public:
  virtual ~Recording() = default;

  /// All topics of the file (an unindexed file is scanned once when opened).
  virtual const std::vector<RecordedTopic>& topics() const = 0;

  /// Only messages of these topics are given from now on; begins anew. Empty: of all.
  virtual void select(const std::set<int>& topics) = 0;

  /// The next message in the order of record time, or nothing at the end. Of equal times, the one that is
  /// first in the file. What is damaged is left out and counted in notes(). Throws InputError if the file
  /// cannot be read any more, or needs a library that was not built in.
  virtual std::optional<RecordedMessage> next() = 0;

  /// First and last record time (ns), if the file has messages.
  virtual std::optional<std::pair<std::int64_t, std::int64_t>> time_range() const = 0;

  /// "ROS 1 bag", "rosbag2 SQLite" or "MCAP".
  virtual std::string container() const = 0;

  /// What was found out about the file and how often, in words: truncated, without an index, damaged chunks
  /// left out, ... What reading finds counts since it last began.
  virtual std::map<std::string, std::size_t> notes() const = 0;
};

/// True for a file that begins as one of the containers do (also a rosbag2 file compressed as a whole, which
/// open_recording refuses with the remedy), and for a folder with the metadata.yaml of rosbag2, or a .db3 or
/// .mcap file.
ROSLAM_EXPORT bool is_recording(const std::filesystem::path& path);

/// Opens a recording. The files of a folder are read one after another. Throws InputError naming the file and
/// the remedy if it is missing, not a recording, compressed as a whole, or needs a library that was not built
/// in (ROSLAM_RECORDINGS).
ROSLAM_EXPORT std::unique_ptr<Recording> open_recording(const std::filesystem::path& path);

}  // namespace roslam
