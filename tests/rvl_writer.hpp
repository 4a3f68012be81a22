// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace roslam::ros {

/// Writes RVL (Wilson 2017) as compressed_depth_image_transport does: width, height, stream.
class RvlWriter {
 public:
  static std::vector<std::uint8_t> encode(const cv::Mat& depth) {
    RvlWriter writer;
    writer.put_word(static_cast<std::uint32_t>(depth.cols));
    writer.put_word(static_cast<std::uint32_t>(depth.rows));
    const std::vector<std::uint16_t> pixels(depth.begin<std::uint16_t>(), depth.end<std::uint16_t>());
    int last = 0;
    for (std::size_t at = 0; at < pixels.size();) {
      const std::size_t zeros = writer.put_run(pixels, at, true);
      const std::size_t others = writer.put_run(pixels, at + zeros, false);
      at += zeros;
      for (const std::size_t end = at + others; at < end; ++at) {
        const int difference = pixels[at] - last;
        writer.put(static_cast<std::uint32_t>(difference < 0 ? -2 * difference - 1 : 2 * difference));
        last = pixels[at];
      }
    }
    while (writer.nibbles_ != 0) writer.put_nibble(0);
    return writer.bytes_;
  }

  /// A stream of these numbers, for images that no encoder writes.
  static std::vector<std::uint8_t> of(std::uint32_t width, std::uint32_t height,
                                      const std::vector<std::uint32_t>& numbers) {
    RvlWriter writer;
    writer.put_word(width);
    writer.put_word(height);
    for (const std::uint32_t number : numbers) writer.put(number);
    while (writer.nibbles_ != 0) writer.put_nibble(0);
    return writer.bytes_;
  }

 private:
  void put_word(std::uint32_t word) {
    for (unsigned i = 0; i < 4; ++i) bytes_.push_back(static_cast<std::uint8_t>(word >> (8U * i)));
  }

  void put_nibble(std::uint32_t nibble) {
    word_ = word_ << 4U | nibble;
    if (++nibbles_ < 8) return;
    put_word(word_);
    nibbles_ = 0;
  }

  void put(std::uint32_t number) {
    for (; number > 7; number >>= 3U) put_nibble((number & 7U) | 8U);
    put_nibble(number);
  }

  std::size_t put_run(const std::vector<std::uint16_t>& pixels, std::size_t at, bool of_zeros) {
    std::size_t end = at;
    while (end < pixels.size() && (pixels[end] == 0) == of_zeros) ++end;
    put(static_cast<std::uint32_t>(end - at));
    return end - at;
  }

  std::vector<std::uint8_t> bytes_;
  std::uint32_t word_ = 0;
  int nibbles_ = 0;
};

}  // namespace roslam::ros
