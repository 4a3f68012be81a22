// SPDX-License-Identifier: BSD-3-Clause
// OctoMap files, read by OctoMap and by this library, and detection of damaged ones.
#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <filesystem>
#include <memory>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "tests/dense_scene.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace {
using namespace roslam;
using Path = std::filesystem::path;

constexpr double kCell = 0.2;  // metres

// A wall seen from two places, in the order asked for.
OccupancyMap scene_space(bool is_reversed = false) {
  const dense_scene::Slab wall{2, 3.05};
  const Camera camera = scene::small_camera();
  std::vector<SE3> poses{SE3(), SE3(so3_exp({0.0, 0.3, 0.0}), {0.5, 0.1, -0.2})};
  if (is_reversed) std::swap(poses[0], poses[1]);
  OccupancyMap space(kCell);
  for (const SE3& pose : poses)
    space.add_view(dense_scene::view(dense_scene::show({wall}, pose, camera), camera), pose);
  SurfaceMap surface;
  for (int i = -100; i < 100; ++i)
    for (int j = -100; j < 100; ++j)
      surface.points.push_back({{0.02F * static_cast<float>(i), 0.02F * static_cast<float>(j), 3.05F},
                                Eigen::Vector3f::UnitZ(),
                                {1, 2, 3}});
  space.add_surface(surface);
  return space;
}

OccupancyState state(const octomap::OcTree& tree, const Eigen::Vector3d& at) {
  const octomap::OcTreeNode* node = tree.search(at.x(), at.y(), at.z());
  return node == nullptr             ? OccupancyState::kUnknown
         : tree.isNodeOccupied(node) ? OccupancyState::kOccupied
                                     : OccupancyState::kFree;
}

// Calls test with the centre of each cell in and about the scene.
template <typename Test>
void at_each_cell(const Test& test) {
  for (int z = -10; z < 30; ++z)
    for (int y = -20; y < 20; ++y)
      for (int x = -20; x < 20; ++x) test(Eigen::Vector3d((Eigen::Array3d(x, y, z) + 0.5) * kCell));
}

std::string error_of(const Path& file) {
  try {
    OccupancyMap::read(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

class OccupancyFileTest : public testing::Test {
 protected:
  void SetUp() override { make_folder(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  // Expects one line that names the file and what is wrong.
  void expect_refused(const std::string& bytes, const std::string& word) const {
    write_file(folder / "bad.bt", bytes);
    const std::string error = error_of(folder / "bad.bt");
    EXPECT_NE(error.find("bad.bt"), std::string::npos) << word;
    EXPECT_NE(error.find(word), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }

  const Path folder = scratch_path();
};

TEST_F(OccupancyFileTest, IsReadByOctoMapAsItWasWritten) {
  const OccupancyMap space = scene_space();
  space.write(folder / "map.bt");
  space.write(folder / "map.ot");
  octomap::OcTree states(1.0);
  ASSERT_TRUE(states.readBinary((folder / "map.bt").string()));
  const std::unique_ptr<octomap::AbstractOcTree> any(
      octomap::AbstractOcTree::read((folder / "map.ot").string()));
  const auto* probabilities = dynamic_cast<octomap::OcTree*>(any.get());
  ASSERT_NE(probabilities, nullptr);
  std::map<OccupancyState, int> met;
  for (const octomap::OcTree* tree : {static_cast<const octomap::OcTree*>(&states), probabilities}) {
    EXPECT_EQ(tree->getResolution(), kCell);
    at_each_cell([&](const Eigen::Vector3d& at) {
      ASSERT_EQ(state(*tree, at), space.at(at)) << at.transpose();
      ++met[space.at(at)];
    });
  }
  for (const OccupancyState each :
       {OccupancyState::kUnknown, OccupancyState::kFree, OccupancyState::kOccupied})
    EXPECT_GT(met[each], 200);
  // The tree is fully pruned, and .bt is lossless.
  EXPECT_EQ(states.size(), probabilities->size());
  octomap::OcTree pruned(states);
  pruned.prune();
  EXPECT_EQ(pruned.size(), states.size());
  EXPECT_TRUE(states == *probabilities);
}

TEST_F(OccupancyFileTest, IsReadBackAndWrittenTheSame) {
  const OccupancyMap space = scene_space();
  for (const char* name : {"map.bt", "map.ot"}) {
    space.write(folder / name);
    const OccupancyMap read = OccupancyMap::read(folder / name);
    EXPECT_EQ(read.resolution(), kCell);
    EXPECT_EQ(read.free_volume(), space.free_volume());
    at_each_cell([&](const Eigen::Vector3d& at) { ASSERT_EQ(read.at(at), space.at(at)) << at.transpose(); });
    read.write(folder / (std::string("again_") + name));
    EXPECT_EQ(content(folder / (std::string("again_") + name)), content(folder / name));
    scene_space(true).write(folder / (std::string("reversed_") + name));
    EXPECT_EQ(content(folder / (std::string("reversed_") + name)), content(folder / name));
  }
  for (const char* name : {"empty.bt", "empty.ot"}) {
    OccupancyMap(1.0 / 3.0).write(folder / name);
    EXPECT_EQ(OccupancyMap::read(folder / name).at({0, 0, 0}), OccupancyState::kUnknown);
    EXPECT_EQ(OccupancyMap::read(folder / name).resolution(), 1.0 / 3.0);
  }
}

TEST_F(OccupancyFileTest, ReadsWhatOctoMapWrites) {
  octomap::OcTree tree(0.1);
  for (int i = 0; i < 40; ++i) {
    tree.updateNode(0.1F * static_cast<float>(i), 0.05F, 0.05F, false);
    tree.updateNode(0.1F * static_cast<float>(i), 0.15F, 0.05F, i % 3 == 0);
  }
  tree.write((folder / "other.ot").string());
  const OccupancyMap read = OccupancyMap::read(folder / "other.ot");
  for (int y = -1; y < 4; ++y)
    for (int x = -2; x < 44; ++x) {
      const Eigen::Vector3d at((x + 0.5) * 0.1, (y + 0.5) * 0.1, 0.05);
      EXPECT_EQ(read.at(at), state(tree, at));
    }
}

TEST_F(OccupancyFileTest, SaysWhatIsWrongWithAFile) {
  const std::string head = "# Octomap OcTree binary file\n# a comment\n#\nid OcTree\n";
  const std::string data = std::string("data\n") + '\x01' + '\0';
  EXPECT_EQ(error_of(folder / "none.bt").find((folder / "none.bt").string()), 0U);
  EXPECT_NE(error_of(folder).find("cannot be read"), std::string::npos);
  expect_refused("", "empty");
  expect_refused("ply\nformat ascii 1.0\n", "does not begin");
  expect_refused(head + "size 2\nres 0.1\n", "no end");
  expect_refused(head + "size 2\n" + data, "resolution");
  expect_refused(head + "size 2\nres -1\n" + data, "resolution");
  expect_refused(head + "size 2\nres nan\n" + data, "resolution");
  expect_refused(head + "size many\nres 0.1\n" + data, "number of nodes");
  expect_refused(head + "size 3\nres 0.1\n" + data, "2 nodes, not 3");
  expect_refused(head + "size 1\nres 0.1\ndata\n" + std::string(2, '\0'), "has none");
  // Each node the parent of eight.
  expect_refused(head + "size 1000\nres 0.1\ndata\n" + std::string(1000, '\xff'), "deeper");
  expect_refused("# Octomap OcTree file\nid OcTree\nsize 9\nres 0.1\ndata\n" + std::string(1000, '\x3f'),
                 "deeper");
  expect_refused("# Octomap OcTree file\nid OcTree\nsize 9\nres 0.1\ndata\n" + std::string(1000, '\xff'),
                 "probability");
  octomap::ColorOcTree colours(0.1);
  colours.updateNode(1.0F, 1.0F, 1.0F, true);
  colours.write((folder / "colours.ot").string());
  EXPECT_NE(error_of(folder / "colours.ot").find("ColorOcTree"), std::string::npos);
}

TEST_F(OccupancyFileTest, RefusesAFileThatWasCutAnywhere) {
  OccupancyMap space(0.5);
  SurfaceMap surface;
  for (int i = 0; i < 6; ++i)
    surface.points.push_back({{static_cast<float>(i), 0.3F, 0.3F}, Eigen::Vector3f::UnitZ(), {1, 2, 3}});
  space.add_surface(surface);
  for (const char* name : {"map.bt", "map.ot"}) {
    space.write(folder / name);
    const std::string whole = content(folder / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      write_file(folder / name, whole.substr(0, length));
      ASSERT_NE(error_of(folder / name), "") << name << " of " << length << " bytes";
    }
  }
}

TEST_F(OccupancyFileTest, AFullDiskCostsNoMap) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  for (const char* name : {"map.bt", "map.ot"}) {
    const Path file = folder / name;
    scene_space().write(file);
    const std::string before = content(file);
    std::filesystem::create_symlink("/dev/full", Path(file) += ".part");
    EXPECT_THROW(OccupancyMap(0.1).write(file), OutputError);
    EXPECT_EQ(content(file), before);
  }
  EXPECT_THROW(OccupancyMap(0.1).write(folder / "none" / "map.bt"), OutputError);
}

TEST_F(OccupancyFileTest, NamesBothEndingsWhereAnotherIsAskedFor) {
  try {
    OccupancyMap(0.1).write(folder / "map.octomap");
    FAIL();
  } catch (const OptionsError& error) {
    EXPECT_NE(std::string(error.what()).find(".bt or .ot"), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "map.octomap"));
}
}  // namespace
