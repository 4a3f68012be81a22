// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/surface_file.hpp"

#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "roslam/common/binary.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/ply_reader.hpp"

namespace roslam {

namespace {
void put(BinaryWriter& writer, const Eigen::Vector3f& vector) {
  for (const float value : vector) writer.put(value);
}
}  // namespace

void write_surface_ply(const std::filesystem::path& file, const SurfaceMap& surface, bool with_triangles) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment RO-SLAM dense map, world frame, metres\n"
      "comment label: Cityscapes train id, 255 unknown; provenance: 0 measured, 128 reprojected, 255 "
      "inpainted\n"
      "comment spacing " +
      std::to_string(surface.spacing) + "\nelement vertex " + std::to_string(surface.points.size()) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    bytes += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue", "label", "provenance"})
    bytes += std::string("property uchar ") + name + "\n";
  if (with_triangles) {
    bytes += "element face " + std::to_string(surface.triangles.size()) +
             "\nproperty list uchar uint vertex_indices\n";
  }
  BinaryWriter writer;
  writer.put_bytes(bytes + "end_header\n");
  for (const SurfacePoint& point : surface.points) {
    put(writer, point.position);
    put(writer, point.normal);
    for (int c = 2; c >= 0; --c) writer.put(point.colour[c]);
    writer.put(point.label);
    writer.put(static_cast<std::uint8_t>(point.provenance));
  }
  if (with_triangles) {
    for (const auto& triangle : surface.triangles) {
      writer.put(std::uint8_t{3});
      for (const std::uint32_t corner : triangle) writer.put(corner);
    }
  }
  replace_file(file, writer.bytes());
}

void write_surface_pcd(const std::filesystem::path& file, const SurfaceMap& surface) {
  const std::string count = std::to_string(surface.points.size());
  BinaryWriter writer;
  writer.put_bytes(
      "# .PCD v0.7 - RO-SLAM dense map, world frame, metres\nVERSION 0.7\n"
      "FIELDS x y z rgb normal_x normal_y normal_z label provenance\n"
      "SIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F U F F F U U\nCOUNT 1 1 1 1 1 1 1 1 1\n"
      "WIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n");
  for (const SurfacePoint& point : surface.points) {
    put(writer, point.position);
    const cv::Vec3b& bgr = point.colour;
    writer.put(static_cast<std::uint32_t>(bgr[2] << 16 | bgr[1] << 8 | bgr[0]));
    put(writer, point.normal);
    writer.put(std::uint32_t{point.label});
    writer.put(static_cast<std::uint32_t>(point.provenance));
  }
  replace_file(file, writer.bytes());
}

namespace {
// Sets one value of a point; ignores unknown names.
void set_value(SurfacePoint& point, const std::string& name, double value) {
  const auto real = static_cast<float>(value);
  const auto byte = cv::saturate_cast<std::uint8_t>(value);
  if (name == "x") point.position.x() = real;
  if (name == "y") point.position.y() = real;
  if (name == "z") point.position.z() = real;
  if (name == "nx") point.normal.x() = real;
  if (name == "ny") point.normal.y() = real;
  if (name == "nz") point.normal.z() = real;
  if (name == "red") point.colour[2] = byte;
  if (name == "green") point.colour[1] = byte;
  if (name == "blue") point.colour[0] = byte;
  if (name == "label") point.label = byte;
  if (name == "provenance") point.provenance = static_cast<Provenance>(byte);
}

void read_points(PlyReader& reader, const PlyElement& element, SurfaceMap& surface) {
  std::set<std::string> names;
  for (const PlyProperty& property : element.properties) {
    if (!property.count_type.empty()) reader.fail("its points have lists of values");
    names.insert(property.name);
  }
  for (const char* name : {"x", "y", "z"})
    if (!names.contains(name)) reader.fail(std::string("its points have no ") + name);
  for (std::size_t i = 0; i < element.count; ++i) {
    SurfacePoint point{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), cv::Vec3b(128, 128, 128)};
    for (const PlyProperty& property : element.properties)
      set_value(point, property.name, reader.next(property.type));
    if (!point.position.allFinite()) reader.fail("a point is not finite");
    surface.points.push_back(point);
  }
}

// Polygons become triangle fans.
void read_triangles(PlyReader& reader, const PlyElement& element, SurfaceMap& surface) {
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      const double count = property.count_type.empty() ? 1.0 : reader.next(property.count_type);
      const bool are_corners = property.name == "vertex_indices" || property.name == "vertex_index";
      std::vector<std::uint32_t> corners;
      for (double n = 0.0; n < count; ++n) {
        const double corner = reader.next(property.type);
        if (!are_corners) continue;
        if (!(corner >= 0.0 && corner < static_cast<double>(surface.points.size())))
          reader.fail("a face has a corner that is not a point");
        corners.push_back(static_cast<std::uint32_t>(corner));
      }
      for (std::size_t c = 2; c < corners.size(); ++c)
        surface.triangles.push_back({corners[0], corners[c - 1], corners[c]});
    }
  }
}
}  // namespace

SurfaceMap read_surface_ply(const std::filesystem::path& file) {
  PlyReader reader(file);
  SurfaceMap surface;
  for (const std::string& comment : reader.comments()) {
    std::istringstream words(comment);
    std::string word;
    double value = 0.0;
    if (words >> word >> value && word == "spacing" && value > 0.0) surface.spacing = value;
  }
  for (const PlyElement& element : reader.elements()) {
    if (element.name == "vertex") read_points(reader, element, surface);
    if (element.name == "face") read_triangles(reader, element, surface);
    if (element.name != "vertex" && element.name != "face") break;
  }
  return surface;
}

}  // namespace roslam
