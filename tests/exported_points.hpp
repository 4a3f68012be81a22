// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cdr_message.hpp"
#include "tests/program.hpp"

namespace roslam {

/// A point of a map as a file has it.
struct Point {
  std::array<float, 3> position;
  std::array<std::uint8_t, 3> rgb;
  bool operator==(const Point&) const = default;
  bool operator<(const Point& other) const { return position < other.position; }
};
/// Points of a binary PLY file by a reader of its own: x y z and red green blue.
inline std::vector<Point> ply_points(const std::filesystem::path& file) {
  const std::string bytes = content(file);
  const std::size_t end = bytes.find("end_header\n");
  std::istringstream header(bytes.substr(0, end));
  std::size_t count = 0, step = 0;
  std::map<std::string, std::size_t> offsets;
  bool is_vertex = false;
  for (std::string line, word, type, name; std::getline(header, line);) {
    std::istringstream words(line);
    words >> word >> type >> name;
    if (word == "element") {
      is_vertex = type == "vertex";
      if (is_vertex) count = std::stoul(name);
    }
    if (word != "property" || !is_vertex) continue;
    offsets[name] = step;
    step += type == "float" ? 4 : 1;
  }
  std::vector<Point> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* at = bytes.data() + end + 11 + i * step;
    std::memcpy(points[i].position.data(), at, 12);
    int k = 0;
    for (const char* name : {"red", "green", "blue"})
      points[i].rgb[static_cast<std::size_t>(k++)] = static_cast<std::uint8_t>(at[offsets.at(name)]);
  }
  return points;
}

/// Those of a PointCloud2 message in the frame map, by its fields.
inline std::vector<Point> cloud_points(const std::string& cloud) {
  CdrMessage message(cloud);
  message.stamp();
  EXPECT_EQ(message.text(), "map");
  EXPECT_EQ(message.get<std::uint32_t>(), 1U);  // height
  const auto width = message.get<std::uint32_t>();
  std::map<std::string, std::size_t> offsets;
  const auto fields = message.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < fields; ++i) {
    const std::string name = message.text();
    offsets[name] = message.get<std::uint32_t>();
    EXPECT_EQ(message.get<std::uint8_t>(), 7) << name;  // FLOAT32
    EXPECT_EQ(message.get<std::uint32_t>(), 1U);
  }
  EXPECT_EQ(message.get<std::uint8_t>(), 0);  // little-endian
  const auto step = message.get<std::uint32_t>();
  EXPECT_EQ(message.get<std::uint32_t>(), step * width);
  EXPECT_EQ(message.get<std::uint32_t>(), step * width);
  const std::string data = message.take(static_cast<std::size_t>(step) * width);
  EXPECT_EQ(message.get<std::uint8_t>(), 1);
  EXPECT_TRUE(message.is_at_end());
  std::vector<Point> points(width);
  for (std::size_t i = 0; i < width; ++i) {
    int k = 0;
    for (const char* name : {"x", "y", "z"})
      std::memcpy(&points[i].position[static_cast<std::size_t>(k++)], &data[i * step + offsets.at(name)], 4);
    std::uint32_t rgb = 0;  // as the Point Cloud Library unpacks it
    std::memcpy(&rgb, &data[i * step + offsets.at("rgb")], 4);
    EXPECT_EQ(rgb >> 24, 0U);
    points[i].rgb = {static_cast<std::uint8_t>(rgb >> 16), static_cast<std::uint8_t>(rgb >> 8),
                     static_cast<std::uint8_t>(rgb)};
  }
  return points;
}

}  // namespace roslam
