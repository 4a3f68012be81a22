// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "roslam/recordings/recording.hpp"

namespace roslam {

/// The topics of a recording. Channels of the file (connections of publishers) with the same name, type and
/// encoding are one topic.
class TopicTable {
 public:
  /// name: of the file, for messages.
  explicit TopicTable(std::string name) : name_(std::move(name)) {}

  /// The topic's id; a new one if there is none like it. Its message count is added. Definitions beyond 64 MB
  /// in all are left empty. Throws InputError if there are more than 65536 topics, or 64 MB of names.
  int add(RecordedTopic topic);

  /// Says which topic a channel of the file is of. Throws InputError if there are more than 65536 channels.
  void assign(std::uint32_t channel, int topic);

  /// The topic of a channel, if the file has described it.
  std::optional<int> of(std::uint32_t channel) const;

  void count(int topic, std::size_t messages);

  const std::vector<RecordedTopic>& all() const { return topics_; }

 private:
  std::string name_;
  std::vector<RecordedTopic> topics_;
  std::map<std::tuple<std::string, std::string, std::string>, int> ids_;  // by name, type and encoding
  std::unordered_map<std::uint32_t, int> of_channel_;
  std::size_t name_bytes_ = 0;
  std::size_t definition_bytes_ = 0;
};

}  // namespace roslam
