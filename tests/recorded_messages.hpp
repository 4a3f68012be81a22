// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/recordings/recording.hpp"

namespace roslam {

/// A message of a recording, with its topic's name.
struct Message {
  std::string topic;
  std::int64_t time;
  std::string data;
  bool operator==(const Message&) const = default;
};

inline std::vector<Message> read_all(Recording& recording) {
  std::vector<Message> messages;
  while (const auto message = recording.next()) {
    messages.push_back({recording.topics().at(static_cast<std::size_t>(message->topic)).name, message->time,
                        std::string(message->data.begin(), message->data.end())});
  }
  return messages;
}

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

inline std::string bytes_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void put(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace roslam
