// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/rvl.hpp"

#include <algorithm>
#include <limits>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::size_t kWord = 4;                    // bytes
constexpr std::uint32_t kLargestSide = 16384;       // pixels
constexpr std::uint64_t kMostPixels = 1ULL << 26U;  // a few bytes can stand for all of them
constexpr unsigned kLongest = 30;                   // bits of a number that further ones may follow

std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < kWord; ++i) word |= std::uint32_t{bytes[at + i]} << (8U * i);
  return word;
}

// Numbers of a stream of 32-bit words, little endian, whose nibbles are read from the highest: three bits of
// a number each, the lowest first, and a bit that says whether more follow.
class Numbers {
 public:
  explicit Numbers(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint32_t next() {
    std::uint64_t number = 0;
    for (unsigned shift = 0; shift <= kLongest; shift += 3) {
      const std::uint32_t nibble = next_nibble();
      number |= std::uint64_t{nibble & 7U} << shift;
      if ((nibble & 8U) != 0) continue;
      if (number > std::numeric_limits<std::uint32_t>::max()) break;
      return static_cast<std::uint32_t>(number);
    }
    throw InputError("RVL depth image with a number that is too large");
  }

 private:
  std::uint32_t next_nibble() {
    if (left_ == 0) {
      if (bytes_.size() - at_ < kWord) throw InputError("RVL depth image is truncated");
      word_ = word_at(bytes_, at_);
      at_ += kWord;
      left_ = 2 * kWord;
    }
    --left_;
    const std::uint32_t nibble = word_ >> 28U;
    word_ <<= 4U;
    return nibble;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;    // of the next word
  std::size_t left_ = 0;  // nibbles of the word
  std::uint32_t word_ = 0;
};

// Even numbers are differences from 0 upward, odd ones from -1 downward.
std::int64_t difference_of(std::uint32_t number) {
  const std::int64_t half = number / 2U;
  return number % 2U == 0 ? half : -half - 1;
}
}  // namespace

cv::Mat decode_rvl(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHeader = 2 * kWord;
  if (bytes.size() < kHeader) throw InputError("RVL depth image is truncated");
  const std::uint32_t width = word_at(bytes, 0), height = word_at(bytes, kWord);
  const bool is_possible = width > 0 && height > 0 && width <= kLargestSide && height <= kLargestSide &&
                           std::uint64_t{width} * height <= kMostPixels;
  if (!is_possible)
    throw InputError("RVL depth image of " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels");
  cv::Mat image = cv::Mat::zeros(static_cast<int>(height), static_cast<int>(width), CV_16UC1);
  auto* pixel = image.ptr<std::uint16_t>();
  Numbers numbers(bytes.subspan(kHeader));
  const auto next_run = [&](std::size_t left) {
    const std::size_t run = numbers.next();
    if (run > left) throw InputError("RVL depth image with more pixels than its size");
    return run;
  };
  std::int64_t value = 0;  // of the last pixel that was not 0
  for (std::size_t left = image.total(); left > 0;) {
    const std::size_t zeros = next_run(left);
    pixel += zeros;
    left -= zeros;
    if (left == 0) break;
    const std::size_t others = next_run(left);
    left -= others;
    for (const auto* end = pixel + others; pixel < end; ++pixel) {
      value += difference_of(numbers.next());
      if (value < 0 || value > std::numeric_limits<std::uint16_t>::max())
        throw InputError("RVL depth image with a depth that does not fit 16 bits");
      *pixel = static_cast<std::uint16_t>(value);
    }
  }
  return image;
}

}  // namespace roslam
