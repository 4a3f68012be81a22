// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "recording/map_render.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/surface_file.hpp"
#include "tests/scratch.hpp"

namespace {
using namespace roslam;
using namespace roslam::recording;
using Path = std::filesystem::path;

SurfaceMap triangle() {
  SurfaceMap surface;
  surface.spacing = 0.05;
  surface.points = {{{1.0F, 2.0F, 3.0F}, {0.0F, 0.0F, 1.0F}, {10, 20, 30}, 8, Provenance::kMeasured},
                    {{-1.5F, 0.25F, 3.5F}, {0.0F, 1.0F, 0.0F}, {255, 0, 128}, 255, Provenance::kReprojected},
                    {{0.0F, -2.0F, 1.0F}, {1.0F, 0.0F, 0.0F}, {0, 255, 1}, 13, Provenance::kInpainted}};
  surface.triangles = {{0, 1, 2}};
  return surface;
}

std::string bytes_of(const Path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string error_of(const Path& file) {
  try {
    read_surface_ply(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

class SurfaceFile : public testing::Test {
 protected:
  void SetUp() override { make_folder(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  const Path folder = scratch_path();
};

TEST_F(SurfaceFile, IsReadAsItWasWritten) {
  const SurfaceMap surface = triangle();
  for (const bool with_triangles : {false, true}) {
    write_surface_ply(folder / "map.ply", surface, with_triangles);
    const SurfaceMap read = read_surface_ply(folder / "map.ply");
    ASSERT_EQ(read.points.size(), 3U);
    EXPECT_EQ(read.spacing, 0.05);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(read.points[i].position, surface.points[i].position);
      EXPECT_EQ(read.points[i].normal, surface.points[i].normal);
      EXPECT_EQ(read.points[i].colour, surface.points[i].colour);
      EXPECT_EQ(read.points[i].label, surface.points[i].label);
      EXPECT_EQ(read.points[i].provenance, surface.points[i].provenance);
    }
    EXPECT_EQ(read.triangles.size(), with_triangles ? 1U : 0U);
  }
}

TEST_F(SurfaceFile, ReadsWhatOthersWrite) {
  write_file(
      folder / "other.ply",
      "ply\r\nformat ascii 1.0\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\nproperty "
      "double z\r\nproperty float quality\r\nelement face 1\r\nproperty list uchar int "
      "vertex_index\r\nend_header\r\n0 0 0 7\r\n1 0 0 7\r\n1 1e0 0 7\r\n0 1 -0.5 7\r\n4 0 1 2 3\r\n");
  const SurfaceMap read = read_surface_ply(folder / "other.ply");
  ASSERT_EQ(read.points.size(), 4U);
  EXPECT_FLOAT_EQ(read.points[3].position.z(), -0.5F);
  EXPECT_EQ(read.points[0].provenance, Provenance::kMeasured);
  EXPECT_EQ(read.triangles.size(), 2U);  // of the square
}

TEST_F(SurfaceFile, SaysWhatIsWrongWithAFile) {
  const std::string begin = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "header"},
      {"solid\n", "ply"},
      {"ply\nformat binary_big_endian 1.0\n", "binary_big_endian"},
      {begin + "end_header\n1 2\n", "no z"},
      {begin + "property float z\nend_header\n1 2\n", "too early"},
      {begin + "property float z\nend_header\n1 2 x\n", "'x'"},
      {begin + "property float z\nend_header\n1 2 nan\n", "finite"},
      {begin + "property colour z\nend_header\n1 2 3\n", "colour"},
      {begin + "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 "
               "3\n3 0 0 9\n",
       "corner"},
      {"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "count"},
      {begin + "property float z\nelement face 999999999999999\nend_header\n1 2 3\n", "no properties"},
  };
  for (const auto& [content, word] : cases) {
    write_file(folder / "bad.ply", content);
    const std::string error = error_of(folder / "bad.ply");
    EXPECT_NE(error.find("bad.ply"), std::string::npos) << content;
    EXPECT_NE(error.find(word), std::string::npos) << error;
  }
  EXPECT_NE(error_of(folder / "none.ply").find("none.ply"), std::string::npos);
  write_surface_ply(folder / "cut.ply", triangle(), true);
  const std::string whole = bytes_of(folder / "cut.ply");
  write_file(folder / "cut.ply", whole.substr(0, whole.size() - 1));
  EXPECT_NE(error_of(folder / "cut.ply").find("too early"), std::string::npos);
}

TEST_F(SurfaceFile, LeavesTheOldFileWhereTheNewOneCannotBeWritten) {
  write_surface_ply(folder / "map.ply", triangle(), false);
  const std::string before = bytes_of(folder / "map.ply");
  std::filesystem::create_directory(folder / "map.ply.part");  // in the way of the new one
  EXPECT_THROW(write_surface_ply(folder / "map.ply", {}, false), OutputError);
  EXPECT_EQ(bytes_of(folder / "map.ply"), before);
}

TEST_F(SurfaceFile, WritesAnEmptyMap) {
  write_surface_ply(folder / "map.ply", {}, true);
  EXPECT_TRUE(read_surface_ply(folder / "map.ply").points.empty());
  write_surface_pcd(folder / "map.pcd", {});
  EXPECT_NE(bytes_of(folder / "map.pcd").find("POINTS 0\n"), std::string::npos);
}

TEST_F(SurfaceFile, WritesPcdOfTheLengthItsHeaderTells) {
  write_surface_pcd(folder / "map.pcd", triangle());
  const std::string bytes = bytes_of(folder / "map.pcd");
  const std::string mark = "DATA binary\n";
  ASSERT_NE(bytes.find(mark), std::string::npos);
  EXPECT_EQ(bytes.size() - bytes.find(mark) - mark.size(), 3U * 9U * 4U);
}

TEST(MapImage, ShowsThingsWhereTheyAreFromAbove) {
  SurfaceMap surface;
  surface.points = {
      {{0.0F, 0.0F, 0.0F}, {0, 0, 1}, {255, 0, 0}, 0, Provenance::kMeasured},
      {{4.0F, 0.0F, 0.0F}, {0, 0, 1}, {0, 255, 0}, 0, Provenance::kReprojected},
      {{0.0F, 2.0F, 0.0F}, {0, 0, 1}, {0, 0, 255}, 0, Provenance::kInpainted},
      {{0.0F, 2.0F, -1.0F}, {0, 0, 1}, {9, 9, 9}, 0, Provenance::kInpainted}};  // below the last
  const Viewpoint view = top_view(surface, {400, 200});
  const cv::Mat image = draw_surface(surface, view, MapColour::kRgb, 0.1);
  const auto colour_at = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector2d pixel = view.camera.project(view.T_world_camera.inverse() * point);
    return image.at<cv::Vec3b>(static_cast<int>(std::lround(pixel.y())),
                               static_cast<int>(std::lround(pixel.x())));
  };
  EXPECT_EQ(colour_at({0, 0, 0}), cv::Vec3b(255, 0, 0));
  EXPECT_EQ(colour_at({4, 0, 0}), cv::Vec3b(0, 255, 0));
  EXPECT_EQ(colour_at({0, 2, 0}), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(colour_at({2, 1, 0}), cv::Vec3b(255, 255, 255));
  // x to the right, y up.
  const Eigen::Vector2d origin =
      view.camera.project(view.T_world_camera.inverse() * Eigen::Vector3d(0, 0, 0));
  const Eigen::Vector2d along = view.camera.project(view.T_world_camera.inverse() * Eigen::Vector3d(4, 2, 0));
  EXPECT_GT(along.x(), origin.x());
  EXPECT_LT(along.y(), origin.y());
}

// A floor and a wall, of a world whose first camera looked down by 20 degrees.
TEST(MapImage, IsLevelWhereTheWorldIsNot) {
  const Eigen::Matrix3f tilt =
      Eigen::AngleAxisf(0.35F, Eigen::Vector3f(0.6F, -0.8F, 0.0F)).toRotationMatrix();
  SurfaceMap surface;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 40; ++k) {
      const float a = 0.1F * static_cast<float>(i), b = 0.1F * static_cast<float>(k);
      surface.points.push_back({tilt * Eigen::Vector3f(a, b, 0.0F), tilt.col(2), {0, 200, 0}});
      surface.points.push_back({tilt * Eigen::Vector3f(0.0F, a, b), tilt.col(0), {200, 0, 0}});
    }
  }
  EXPECT_LT((up_of(surface) - tilt.col(2)).norm(), 1e-3F);
  // From above the wall is a line.
  const cv::Mat image = draw_surface(surface, top_view(surface, {200, 200}), MapColour::kRgb, 0.1);
  cv::Mat wall;
  cv::inRange(image, cv::Scalar(200, 0, 0), cv::Scalar(200, 0, 0), wall);
  EXPECT_LT(cv::countNonZero(wall), 200 * 12);
  surface.points.resize(100);  // too few to tell
  EXPECT_EQ(up_of(surface), Eigen::Vector3f::UnitZ());
}

TEST(MapImage, ColoursByWhatIsAsked) {
  SurfaceMap surface;
  surface.points = {{{0.0F, 0.0F, 2.0F}, {0, 0, -1}, {255, 0, 0}, 8, Provenance::kInpainted}};
  Viewpoint view;
  for (const std::string& name : map_colour_names()) {
    const cv::Mat image = draw_surface(surface, view, *map_colour_from(name), 0.2);
    EXPECT_NE(image.at<cv::Vec3b>(240, 320), cv::Vec3b(255, 255, 255)) << name;
    EXPECT_EQ(image.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255)) << name;
  }
  EXPECT_FALSE(map_colour_from("pink").has_value());
}

TEST(MapImage, OfNothingIsEmpty) {
  const cv::Mat image = draw_surface({}, top_view({}, {64, 48}), MapColour::kHeight, 0.05);
  EXPECT_EQ(cv::norm(image, cv::Mat(48, 64, CV_8UC3, cv::Scalar(255, 255, 255)), cv::NORM_INF), 0.0);
}
}  // namespace
