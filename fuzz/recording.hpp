// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fuzz/fuzz.hpp"
#include "roslam/recordings/recording.hpp"

namespace roslam::fuzz {

/// Reads a recording to its end, and one topic of it again. begin: first bytes that make it the container
/// meant, whatever the fuzzer made of them.
inline int read_recording(const std::uint8_t* data, std::size_t size, std::string_view begin) {
  return expect_result_or_error(data, size, [begin](std::string_view bytes) {
    std::string whole(bytes);
    whole.replace(0, std::min(begin.size(), whole.size()), begin);
    const MemoryFile file(whole);
    const auto recording = open_recording(file.path());
    std::size_t sum = 0;
    const auto read = [&] {
      while (const auto message = recording->next()) {
        sum += recording->topics().at(static_cast<std::size_t>(message->topic)).name.size();
        for (const std::uint8_t byte : message->data) sum += byte;  // all of them may be read
      }
    };
    read();
    recording->select({0});
    read();
    volatile std::size_t result = sum + recording->notes().size();
    (void)result;
  });
}

}  // namespace roslam::fuzz
