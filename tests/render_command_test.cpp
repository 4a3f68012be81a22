// SPDX-License-Identifier: BSD-3-Clause
// Maps drawn on the command line.
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "roslam/common/write_file.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace {
using namespace roslam;

class Render : public testing::Test {
 protected:
  void SetUp() override {
    make_folder(folder);
    SurfaceMap surface;
    surface.spacing = 0.1;
    for (int y = -20; y <= 20; ++y) {
      for (int x = -20; x <= 20; ++x) {
        const bool is_invented = x > 0;
        surface.points.push_back({{0.1F * static_cast<float>(x), 0.1F * static_cast<float>(y), 0.0F},
                                  {0.0F, 0.0F, 1.0F},
                                  {0, 0, 200},
                                  0,
                                  is_invented ? Provenance::kInpainted : Provenance::kMeasured});
      }
    }
    write_surface_ply(folder / "dense.ply", surface, false);
    // Two metres above, looking along x and down a little.
    Eigen::Matrix3d rotation;
    rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const SE3 pose(SE3(rotation, {-3.0, 0.0, 1.0}));
    write_trajectory(folder / "trajectory.txt", {{0.0, pose}, {1.0, pose}});
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  Outcome render(const std::string& arguments) const {
    return shell_in(folder, std::string(ROSLAM_PROGRAM) + " render " + arguments);
  }
  cv::Mat image(const std::string& name) const { return cv::imread((folder / name).string()); }

  template <typename Test>
  static int count(const cv::Mat& image, const Test& test) {
    int sum = 0;
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) sum += test(image.at<cv::Vec3b>(y, x)) ? 1 : 0;
    return sum;
  }

  const std::filesystem::path folder = scratch_path();
};

TEST_F(Render, DrawsEachViewInTheSizeAskedFor) {
  for (const std::string view : {"top", "front", "follow"}) {
    const Outcome outcome = render("dense.ply --view " + view + " --out " + view + ".png --size 300 200");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(image(view + ".png").size(), cv::Size(300, 200));
    const auto is_drawn = [](const cv::Vec3b& colour) { return colour != cv::Vec3b(255, 255, 255); };
    EXPECT_GT(count(image(view + ".png"), is_drawn), 1000) << view;
  }
}

TEST_F(Render, LeavesOutWhatWasInvented) {
  ASSERT_EQ(render("dense.ply --out all.png --size 300 300 --colour provenance").code, 0);
  ASSERT_EQ(render("dense.ply --out seen.png --size 300 300 --colour provenance --no-inpainted").code, 0);
  ASSERT_EQ(render("dense.ply --out old.png --size 300 300 --colour provenance --no-invented").code, 0);
  const auto is_magenta = [](const cv::Vec3b& c) { return c[0] > c[1] + 50 && c[2] > c[1] + 50; };
  EXPECT_GT(count(image("all.png"), is_magenta), 10000);
  EXPECT_EQ(count(image("seen.png"), is_magenta), 0);
  EXPECT_EQ(count(image("old.png"), is_magenta), 0);  // by the flag's old name
}

TEST_F(Render, TakesTheFolderOfARun) {
  ASSERT_EQ(render(". --view front --out a.png").code, 0);
  ASSERT_EQ(render("dense.ply --view front --trajectory . --out b.png").code, 0);
  EXPECT_EQ(content(folder / "a.png"), content(folder / "b.png"));
  make_folder(folder / "empty");
  EXPECT_NE(render("empty --out x.png").error.find("empty: the folder holds no dense.ply"),
            std::string::npos);
}

TEST_F(Render, SaysWhatIsWrong) {
  EXPECT_EQ(render("none.ply --out x.png").code, 1);
  EXPECT_NE(render("none.ply --out x.png").error.find("none.ply"), std::string::npos);
  EXPECT_EQ(render("dense.ply --out /no/such/folder/x.png").code, 1);
  EXPECT_EQ(render("dense.ply --out x.png --view side").code, 2);
  EXPECT_EQ(render("dense.ply --out x.png --size 0 0").code, 2);
  std::filesystem::remove(folder / "trajectory.txt");
  EXPECT_NE(render("dense.ply --out x.png --view front").error.find("trajectory.txt"), std::string::npos);
  write_surface_ply(folder / "empty.ply", {}, false);
  EXPECT_NE(render("empty.ply --out x.png").error.find("no points"), std::string::npos);
}
}  // namespace
