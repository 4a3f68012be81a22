// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/mavlink_frame.hpp"

#include <algorithm>
#include <cstdlib>

// The first byte says into how many parts the others are cut. What is decoded must survive being encoded; of
// the rest the decoder may keep one frame at most.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam::telemetry;
  if (size == 0) return 0;
  const std::size_t part = 1U + data[0];
  MavlinkDecoder decoder, again;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  for (std::size_t at = 0; at < bytes.size(); at += part) {
    for (const ReceivedMessage& found : decoder.add(bytes.subspan(at, std::min(part, bytes.size() - at)))) {
      const auto frame = encode(found.message, found.sender, found.sequence);
      const auto back = again.add(frame);
      if (back.size() != 1 || encode(back[0].message, back[0].sender, back[0].sequence) != frame)
        std::abort();
    }
  }
  return 0;
}
