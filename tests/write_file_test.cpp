// SPDX-License-Identifier: BSD-3-Clause
// A file is written in whole or not at all, and the old one stays where the new one cannot be written.
#include "roslam/common/write_file.hpp"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "evaluation/trajectory_plot.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/sensors/image_file.hpp"
#include "tests/file_size_limit.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLimit = 1000;  // bytes

class WriteFile : public testing::Test {
 protected:
  WriteFile() { fs::create_directories(folder_); }
  ~WriteFile() override { fs::remove_all(folder_); }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    return names;
  }

  static std::string error_of(const std::function<void()>& write) {
    try {
      write();
    } catch (const OutputError& error) {
      return error.what();
    }
    return "";
  }

  // Each kind of file with content beyond the limit.
  static std::vector<std::pair<std::string, std::function<void(const fs::path&)>>> writers() {
    static const Trajectory poses(100, StampedPose{});
    cv::Mat noise(64, 64, CV_8UC3);
    cv::randu(noise, 0, 255);
    const auto map = std::make_shared<Map>(std::vector<float>{1.0F});
    auto view = std::make_shared<ObservedFrame>();
    view->pixels.resize(100);
    view->depths.resize(100);
    view->levels.resize(100);
    view->angles.resize(100);
    view->colours.resize(100);
    view->descriptors.resize(100);
    const KeyframeId keyframe = map->add_keyframe(0, 0.0, SE3(), view);
    for (std::uint32_t i = 0; i < 100; ++i) map->add_landmark({0.0, 0.0, 1.0}, keyframe, i);
    return {{"text", [](const fs::path& file) { write_file(file, std::string(2 * kLimit, 'x')); }},
            {"flushed", [](const fs::path& file) { replace_file(file, std::string(2 * kLimit, 'x')); }},
            {"trajectory.txt", [](const fs::path& file) { write_trajectory(file, poses); }},
            {"map.ply", [map](const fs::path& file) { write_map_ply(file, *map, SubmapId{0}); }},
            {"image.png", [noise](const fs::path& file) { write_image(file, noise); }},
            {"image.jpg", [noise](const fs::path& file) { write_image(file, noise); }},
            {"plot.png", [noise](const fs::path& file) { evaluation::write_png(file, noise); }}};
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(WriteFile, WhatDoesNotFitLeavesNothing) {
  const FileSizeLimit limit(kLimit);
  for (const auto& [name, write] : writers()) {
    const std::string error = error_of([&, &to_file = write] { to_file(folder_ / name); });
    EXPECT_NE(error.find((folder_ / name).string() + ": cannot be written in full"), std::string::npos)
        << error;
    EXPECT_NE(error.find("ulimit"), std::string::npos) << error;
    EXPECT_EQ(files(), std::vector<std::string>{}) << name;
  }
}

TEST_F(WriteFile, WhatDoesNotFitLeavesTheOldFile) {
  for (const auto& [name, write] : writers()) {
    write_file(folder_ / name, "old");
    const FileSizeLimit limit(kLimit);
    EXPECT_NE(error_of([&, &to_file = write] { to_file(folder_ / name); }), "") << name;
    EXPECT_EQ(content(folder_ / name), "old") << name;
    EXPECT_FALSE(fs::exists(folder_ / (name + ".part"))) << name;
  }
}

TEST_F(WriteFile, AFullDiskLeavesTheOldFile) {
  if (mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=8k") != 0)
    GTEST_SKIP() << "mounting is not allowed here";
  write_file(folder_ / "file", "old");
  const std::string error = error_of([&] { write_file(folder_ / "file", std::string(100000, 'x')); });
  const std::string after = content(folder_ / "file");
  const auto left = files();
  EXPECT_EQ(umount(folder_.c_str()), 0);
  EXPECT_NE(error.find("free space"), std::string::npos) << error;
  EXPECT_EQ(after, "old");
  EXPECT_EQ(left, std::vector<std::string>{"file"});
}

TEST_F(WriteFile, DevicesAndPipesAreWrittenThemselves) {
  if (fs::exists("/dev/full")) {
    fs::create_symlink("/dev/full", folder_ / "full");
    EXPECT_NE(error_of([&] { write_file(folder_ / "full", "x"); }).find("free space"), std::string::npos);
    EXPECT_TRUE(fs::is_symlink(folder_ / "full"));
  }
  write_file("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(WriteFile, ALinkStaysALink) {
  write_file(folder_ / "file", "old");
  fs::create_symlink("file", folder_ / "link");
  write_file(folder_ / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(folder_ / "file"), "new");
}

TEST_F(WriteFile, AFolderInTheWayIsAnError) {
  fs::create_directory(folder_ / "file");
  EXPECT_NE(error_of([&] { write_file(folder_ / "file", "x"); }), "");
  EXPECT_NE(error_of([&] { write_file(folder_ / "none/file", "x"); }).find("folder exists"),
            std::string::npos);
}

}  // namespace
}  // namespace roslam
