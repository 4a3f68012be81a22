// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Reads a ROS 2 message in CDR field by field, written after the specification of the OMG: values are
/// aligned to their size, counted from the end of the four bytes of encapsulation. Throws std::out_of_range.
class CdrMessage {
 public:
  explicit CdrMessage(std::string bytes) : bytes_(std::move(bytes)) {
    if (bytes_.substr(0, 4) != std::string("\0\1\0\0", 4)) throw std::out_of_range("encapsulation");
  }

  template <typename T>
  T get() {
    at_ = (at_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    T value;
    std::memcpy(&value, take(sizeof(T)).data(), sizeof(T));
    return value;
  }

  std::string text() {
    const auto size = get<std::uint32_t>();
    const std::string all = take(size);
    return all.substr(0, all.size() - 1);
  }

  std::string take(std::size_t count) {
    if (4 + at_ + count > bytes_.size()) throw std::out_of_range("message is too short");
    at_ += count;
    return bytes_.substr(4 + at_ - count, count);
  }

  std::vector<double> doubles(std::size_t count) {
    std::vector<double> values(count);
    for (double& value : values) value = get<double>();
    return values;
  }

  /// Position and quaternion x y z w.
  SE3 pose() {
    const auto v = doubles(7);
    return SE3::from_parts(Eigen::Quaterniond(v[6], v[3], v[4], v[5]), {v[0], v[1], v[2]});
  }

  /// Nanoseconds.
  std::int64_t stamp() {
    const std::int64_t seconds = get<std::int32_t>();
    return 1'000'000'000 * seconds + get<std::uint32_t>();
  }

  bool is_at_end() const { return 4 + at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace roslam
