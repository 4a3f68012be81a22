// SPDX-License-Identifier: BSD-3-Clause
// Dense maps in formats of other programs, written on the command line and read back by parsers of their own.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "roslam/common/write_file.hpp"
#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace {
using namespace roslam;
namespace fs = std::filesystem;

// A square of the plane z = 0, the right half of which is inpainted.
SurfaceMap square() {
  constexpr int kSide = 20;
  SurfaceMap surface;
  surface.spacing = 0.1;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      surface.points.push_back(
          {{0.1F * static_cast<float>(x) + 0.05F, 0.1F * static_cast<float>(y) + 0.05F, 0.05F},
           {0.0F, 0.0F, 1.0F},
           {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 200},
           static_cast<std::uint8_t>(x % 19),
           x < kSide / 2 ? Provenance::kMeasured : Provenance::kInpainted});
      if (x == 0 || y == 0) continue;
      const auto at = static_cast<std::uint32_t>(y * kSide + x);
      surface.triangles.push_back({at - kSide - 1, at - kSide, at});
      surface.triangles.push_back({at - kSide - 1, at, at - 1});
    }
  }
  return surface;
}

template <typename Value>
Value take(const std::string& bytes, std::size_t& at) {
  Value value{};
  EXPECT_LE(at + sizeof(Value), bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof(Value));
  at += sizeof(Value);
  return value;
}

class Export : public testing::Test {
 protected:
  // A run folder: the map and its free space, as a run writes them.
  void SetUp() override {
    make_folder(folder / "run");
    write_surface_ply(folder / "run/dense.ply", square(), true);
  }
  void TearDown() override { fs::remove_all(folder); }

  // A ray from high above the plane down to it.
  void write_free_space() const {
    DepthKeyframe view{{},
                       cv::Mat(1, 1, CV_8UC3),
                       cv::Mat(1, 1, CV_32FC1, cv::Scalar(2.0)),
                       cv::Mat(1, 1, CV_8UC1),
                       cv::Mat::zeros(1, 1, CV_8UC1)};
    view.camera.cx = view.camera.cy = 0.0;
    OccupancyMap seen(0.25);
    seen.add_view(view, SE3(so3_exp({M_PI, 0.0, 0.0}), {0.6, 0.6, 2.1}));
    seen.write(folder / "run/dense.bt");
  }

  Outcome export_map(const std::string& arguments) const {
    return shell_in(folder, std::string(ROSLAM_PROGRAM) + " map export " + arguments);
  }

  void expect_refused(const std::string& arguments, int code, const std::vector<std::string>& words) const {
    const Outcome outcome = export_map(arguments);
    EXPECT_EQ(outcome.code, code) << arguments;
    for (const std::string& word : words)
      EXPECT_NE(outcome.error.find(word), std::string::npos) << arguments << ": " << outcome.error;
  }

  const fs::path folder = scratch_path();
};

// The Point Cloud Library reads what is written, all of it.
TEST_F(Export, IsReadByThePointCloudLibrary) {
  if (shell_in(folder, "command -v pcl_ply2pcd pcl_convert_pcd_ascii_binary").code != 0)
    GTEST_SKIP() << "pcl-tools are not installed";
  ASSERT_EQ(export_map("run --pcd points.pcd --mesh mesh.ply").code, 0);
  ASSERT_EQ(shell_in(folder, "pcl_ply2pcd mesh.ply from_ply.pcd").code, 0);
  for (const char* file : {"points.pcd", "from_ply.pcd"}) {
    ASSERT_EQ(shell_in(folder, std::string("pcl_convert_pcd_ascii_binary ") + file + " ascii.pcd 0").code, 0);
    std::istringstream text(content(folder / "ascii.pcd"));
    std::string line;
    std::vector<std::string> fields;
    while (std::getline(text, line) && !line.starts_with("DATA")) {
      if (!line.starts_with("FIELDS")) continue;
      std::istringstream names(line.substr(7));
      for (std::string name; names >> name;) fields.push_back(name);
    }
    for (const SurfacePoint& point : square().points) {
      std::map<std::string, double> values;
      for (const std::string& field : fields) text >> values[field];
      ASSERT_TRUE(text) << file;
      EXPECT_NEAR(values["x"], point.position.x(), 1e-5) << file;
      EXPECT_NEAR(values["y"], point.position.y(), 1e-5) << file;
      EXPECT_NEAR(values["normal_z"], 1.0, 1e-6) << file;
      EXPECT_EQ(values["label"], point.label) << file;
      EXPECT_EQ(values["provenance"], static_cast<double>(point.provenance)) << file;
    }
  }
}

TEST_F(Export, WritesPointsAndMeshAsPly) {
  const SurfaceMap surface = square();
  const Outcome outcome = export_map("run --ply points.ply --mesh mesh.ply");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("400 points and 722 triangles: mesh.ply"), std::string::npos) << outcome.out;
  for (const bool is_mesh : {false, true}) {
    const std::string bytes = content(folder / (is_mesh ? "mesh.ply" : "points.ply"));
    EXPECT_EQ(bytes.find("element face 722\nproperty list uchar uint vertex_indices\n") != std::string::npos,
              is_mesh);
    EXPECT_NE(bytes.find("element vertex 400\n"), std::string::npos);
    std::size_t at = bytes.find("end_header\n") + std::strlen("end_header\n");
    for (const SurfacePoint& point : surface.points) {
      for (int i = 0; i < 3; ++i) ASSERT_EQ(take<float>(bytes, at), point.position[i]);
      for (int i = 0; i < 3; ++i) ASSERT_EQ(take<float>(bytes, at), point.normal[i]);
      for (int c = 2; c >= 0; --c) ASSERT_EQ(take<std::uint8_t>(bytes, at), point.colour[c]);
      ASSERT_EQ(take<std::uint8_t>(bytes, at), point.label);
      ASSERT_EQ(take<Provenance>(bytes, at), point.provenance);
    }
    for (std::size_t i = 0; is_mesh && i < surface.triangles.size(); ++i) {
      ASSERT_EQ(take<std::uint8_t>(bytes, at), 3);
      for (const std::uint32_t corner : surface.triangles[i])
        ASSERT_EQ(take<std::uint32_t>(bytes, at), corner);
    }
    EXPECT_EQ(at, bytes.size());
  }
}

TEST_F(Export, WritesPcdWhoseHeaderTellsWhatIsInIt) {
  ASSERT_EQ(export_map("run/dense.ply --pcd map.pcd").code, 0);
  const std::string bytes = content(folder / "map.pcd");
  std::istringstream lines(bytes);
  std::map<std::string, std::vector<std::string>> header;
  for (std::string line; !header.contains("DATA") && std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    for (std::string word; words >> word;) header[name].push_back(word);
  }
  const std::vector<std::string> fields{"x",        "y",        "z",     "rgb",       "normal_x",
                                        "normal_y", "normal_z", "label", "provenance"};
  ASSERT_EQ(header["FIELDS"], fields);
  ASSERT_EQ(header["POINTS"], std::vector<std::string>{"400"});
  ASSERT_EQ(header["DATA"], std::vector<std::string>{"binary"});
  ASSERT_EQ(header["TYPE"].size(), fields.size());
  std::size_t at = static_cast<std::size_t>(lines.tellg());
  for (const SurfacePoint& point : square().points) {
    std::map<std::string, double> values;
    for (std::size_t f = 0; f < fields.size(); ++f) {
      ASSERT_EQ(header["SIZE"][f], "4");
      ASSERT_EQ(header["COUNT"][f], "1");
      values[fields[f]] = header["TYPE"][f] == "F" ? static_cast<double>(take<float>(bytes, at))
                                                   : static_cast<double>(take<std::uint32_t>(bytes, at));
    }
    ASSERT_EQ(values["x"], static_cast<double>(point.position.x()));
    ASSERT_EQ(values["z"], static_cast<double>(point.position.z()));
    ASSERT_EQ(values["normal_z"], 1.0);
    ASSERT_EQ(values["rgb"], (point.colour[2] << 16) + (point.colour[1] << 8) + point.colour[0]);
    ASSERT_EQ(values["label"], point.label);
    ASSERT_EQ(values["provenance"], static_cast<double>(point.provenance));
  }
  EXPECT_EQ(at, bytes.size());
}

TEST_F(Export, LeavesOutWhatNobodySaw) {
  ASSERT_EQ(export_map("run --no-inpainted --mesh mesh.ply --octomap map.bt").code, 0);
  const SurfaceMap seen = read_surface_ply(folder / "mesh.ply");
  EXPECT_EQ(seen.points.size(), 200U);
  EXPECT_EQ(seen.triangles.size(), 19U * 9U * 2U);
  ASSERT_EQ(export_map("run --no-invented --mesh old.ply").code, 0);  // the flag's old name
  EXPECT_EQ(content(folder / "old.ply"), content(folder / "mesh.ply"));
  for (const SurfacePoint& point : seen.points) EXPECT_EQ(point.provenance, Provenance::kMeasured);
  const OccupancyMap space = OccupancyMap::read(folder / "map.bt");
  EXPECT_EQ(space.at({0.5, 0.5, 0.05}), OccupancyState::kOccupied);
  EXPECT_EQ(space.at({1.5, 0.5, 0.05}), OccupancyState::kUnknown);
}

TEST_F(Export, WritesOccupancyWithTheFreeSpaceOfTheRun) {
  const Outcome alone = export_map("run --octomap alone.bt");
  ASSERT_EQ(alone.code, 0) << alone.error;
  EXPECT_NE(alone.error.find("dense.bt"), std::string::npos);
  EXPECT_NE(alone.error.find("only occupied"), std::string::npos);
  EXPECT_EQ(OccupancyMap::read(folder / "alone.bt").resolution(), 0.2);  // twice the spacing
  EXPECT_EQ(OccupancyMap::read(folder / "alone.bt").free_volume(), 0.0);

  write_free_space();
  for (const std::string name : {"map.bt", "map.ot"}) {
    const Outcome outcome = export_map("run --octomap " + name);
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.error, "");
    const OccupancyMap space = OccupancyMap::read(folder / name);
    EXPECT_EQ(space.resolution(), 0.25);  // of dense.bt
    EXPECT_EQ(space.at({0.6, 0.6, 0.05}), OccupancyState::kOccupied);
    EXPECT_EQ(space.at({0.6, 0.6, 1.0}), OccupancyState::kFree);
    EXPECT_EQ(space.at({1.6, 0.6, 1.0}), OccupancyState::kUnknown);
  }
  ASSERT_EQ(export_map("run --octomap fine.bt --resolution 0.05").code, 0);
  const OccupancyMap fine = OccupancyMap::read(folder / "fine.bt");
  EXPECT_EQ(fine.resolution(), 0.05);
  EXPECT_EQ(fine.at({0.6, 0.6, 1.0}), OccupancyState::kFree);
  EXPECT_EQ(fine.at({0.55, 0.55, 0.05}), OccupancyState::kOccupied);
}

TEST_F(Export, RefusesWhatDoesNotFit) {
  expect_refused("run", 2, {"--mesh"});
  expect_refused("run --resolution 0.1 --ply x.ply", 2, {"--octomap"});
  expect_refused("run --octomap map.octomap", 2, {".bt or .ot"});
  expect_refused("run --octomap x.bt --resolution 0", 2, {"--resolution"});
  expect_refused("run/dense.ply --keyframes x.txt", 2, {"--keyframes", "map.roslam"});
  expect_refused("run/dense.ply --ply x.ply --flight 0", 2, {"--session"});
  expect_refused("run/map.roslam --pcd x.pcd", 2, {"--pcd", "dense map"});
  expect_refused("run --keyframes x.txt --mesh x.ply", 2, {"--mesh"});
  // Of a run folder, what holds poses.
  expect_refused("run --keyframes x.txt", 1, {"run: the folder holds no map.roslam"});
  fs::remove(folder / "run/dense.ply");
  expect_refused("run --ply x.ply", 1, {"run/dense.ply", "no such file", "map.roslam"});
  expect_refused("none.ply --ply x.ply", 1, {"none.ply"});
}

TEST_F(Export, SaysWhenThereIsNothingToWrite) {
  SurfaceMap surface;
  write_surface_ply(folder / "empty.ply", surface, true);
  for (const std::string format : {"--ply x.ply", "--mesh x.ply", "--pcd x.pcd", "--octomap x.bt"})
    expect_refused("empty.ply " + format, 1, {"empty.ply", "map is empty", "depth"});
  surface = square();
  write_surface_ply(folder / "points.ply", surface, false);
  expect_refused("points.ply --ply x.ply --mesh y.ply", 1, {"points.ply", "no triangles", "--mesh"});
  for (SurfacePoint& point : surface.points) point.provenance = Provenance::kInpainted;
  write_surface_ply(folder / "invented.ply", surface, true);
  expect_refused("invented.ply --no-inpainted --ply x.ply", 1, {"invented.ply", "leave out --no-inpainted"});
  write_file(folder / "run/dense.bt", "no tree");
  expect_refused("run --octomap x.bt", 1, {"run/dense.bt", "no usable OctoMap file"});
  for (const char* name : {"x.ply", "y.ply", "x.pcd", "x.bt"})
    EXPECT_FALSE(fs::exists(folder / name)) << name;
}

TEST_F(Export, CannotWriteWhereThereIsNoFolder) {
  for (const std::string format :
       {"--ply none/x.ply", "--mesh none/x.ply", "--pcd none/x.pcd", "--octomap none/x.bt"})
    expect_refused("run " + format, 1, {"none/x", "folder"});
}
}  // namespace
