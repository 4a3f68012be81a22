// SPDX-License-Identifier: BSD-3-Clause
// The dense map of a run: its files, and its behaviour with bad input.
#include "roslam/dense/surface_file.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

class DenseRun : public Dataset {
 protected:
  std::size_t points() const { return read_surface_ply(run_ / "dense.ply").points.size(); }
  bool is_there(const char* file) const { return fs::exists(run_ / file); }
  void configure(const std::string& yaml) const { put(scratch_ / "config.yaml", yaml); }
  std::string config() const { return "--config '" + (scratch_ / "config.yaml").string() + "'"; }
};

TEST_F(DenseRun, IsWrittenByDefault) {
  frames_of_run();
  const SurfaceMap surface = read_surface_ply(run_ / "dense.ply");
  EXPECT_GT(surface.points.size(), 5000U);
  EXPECT_GT(surface.triangles.size(), surface.points.size());
  EXPECT_EQ(surface.spacing, 0.05);
  const auto has_class = [&](int label) {
    return std::count_if(surface.points.begin(), surface.points.end(),
                         [&](const SurfacePoint& point) { return point.label == label; });
  };
  EXPECT_GT(has_class(0), static_cast<long>(surface.points.size() / 4));  // road
  const auto dense = report()["dense"];
  EXPECT_EQ(dense["points"], surface.points.size());
  EXPECT_EQ(dense["times_coarsened"], 0);
  EXPECT_GE(dense["keyframes"], 1);
  // Space between the camera and the surfaces is free.
  const OccupancyMap space = OccupancyMap::read(run_ / "dense.bt");
  const SE3 T_world_camera = trajectory().front().T_world_camera;
  EXPECT_EQ(space.at(T_world_camera * Eigen::Vector3d(0.0, 0.0, 2.0)), OccupancyState::kFree);
  EXPECT_EQ(space.at(surface.points.front().position.cast<double>()), OccupancyState::kOccupied);
  EXPECT_EQ(space.at(T_world_camera * Eigen::Vector3d(0.0, 0.0, -5.0)), OccupancyState::kUnknown);
}

TEST_F(DenseRun, HasAReportToLookAt) {
  frames_of_run();
  const std::string html = content(run_ / "report.html");
  for (const char* words :
       {"<h2>Trajectory</h2>", "<h2>Dense map</h2>", "<h2>Processor time</h2>",
        "tracked 10 of 10 frames of the source (100.0 %)", "dense.fuse", "max_memory", "From above."})
    EXPECT_NE(html.find(words), std::string::npos) << words;
  EXPECT_EQ(html.find("http"), std::string::npos);  // it asks for nothing from elsewhere
}

TEST_F(DenseRun, HasErrorsInItsReportWhereTheTruthIsKnown) {
  const Outcome outcome = run_program(
      "run simulated:street --frames 12 --traffic light --quiet --out '" + run_.string() + "'", scratch_);
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const std::string html = content(run_ / "report.html");
  for (const char* words :
       {"absolute error, m", "<h2>Dynamic objects</h2>", "With the holes that they leave."})
    EXPECT_NE(html.find(words), std::string::npos) << words;
}

TEST_F(DenseRun, LeavesNothingBehindWhenItIsNotWanted) {
  frames_of_run();
  ASSERT_TRUE(is_there("dense.ply") && is_there("dense.bt"));
  frames_of_run("--no-dense");
  EXPECT_FALSE(is_there("dense.ply") || is_there("dense.bt"));
  EXPECT_FALSE(report().contains("dense"));
  EXPECT_TRUE(is_there("report.html"));
  fs::copy(run_ / "map.roslam", scratch_ / "map.roslam");
  frames_of_run("--localise-only --map '" + (scratch_ / "map.roslam").string() + "'");
  EXPECT_FALSE(is_there("dense.ply"));
}

TEST_F(DenseRun, IsMadeWithoutRemovalToo) {
  frames_of_run("--dynamic none");
  EXPECT_GT(points(), 5000U);
  EXPECT_FALSE(report().contains("restoration"));
}

TEST_F(DenseRun, BecomesCoarserInsteadOfTooLargeAndSaysSoOnce) {
  configure("dense:\n  voxel_size: 0.01\n  max_memory: 16\n");
  const Outcome outcome = run("--no-loops " + config());
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto dense = report()["dense"];
  EXPECT_GE(dense["times_coarsened"], 1);
  EXPECT_LE(dense["voxel_megabytes"], 16);
  EXPECT_GT(points(), 500U);
  const std::string note = "times as large";
  const std::size_t said = outcome.out.find(note);
  ASSERT_NE(said, std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find(note, said + 1), std::string::npos);
}

// All surfaces lie beyond the fusion range: the dense map is empty, and tracking is not affected.
TEST_F(DenseRun, IsEmptyWhereAllIsOutOfRange) {
  configure("dense:\n  max_depth: 0.5\n");
  const Outcome outcome = run(config());
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("the dense map is empty"), std::string::npos) << outcome.out;
  EXPECT_EQ(points(), 0U);
  EXPECT_FALSE(is_there("dense.bt"));
  EXPECT_NE(content(run_ / "report.html").find("It is empty"), std::string::npos);
  expect_refused(
      run_program("map export '" + run_.string() + "' --pcd '" + (scratch_ / "x.pcd").string() + "'",
                  scratch_),
      {"dense.ply", "empty"});
}

TEST_F(DenseRun, DoesWithoutDepth) {
  for (std::size_t i = 0; i < kFrames; ++i) fs::remove(depth(i));
  const Outcome outcome = run();
  EXPECT_EQ(outcome.code, 1);  // nothing could be tracked
  EXPECT_EQ(points(), 0U);
}

TEST_F(DenseRun, TheEarlierMapDoesNotPassForANewOneThatCannotBeWritten) {
  frames_of_run();
  const std::string before = content(run_ / "dense.ply");
  const std::string report_before = content(run_ / "report.html");
  for (const char* file : {"dense.ply", "report.html"})
    fs::create_directory(run_ / (std::string(file) + ".part"));  // in the way of the new one
  expect_refused(run(), {"dense.ply"});
  EXPECT_FALSE(is_there("dense.ply") || is_there("report.html"));
  EXPECT_TRUE(content(run_ / "previous/dense.ply") == before);
  EXPECT_TRUE(content(run_ / "previous/report.html") == report_before);
  EXPECT_EQ(trajectory().size(), kFrames);
}

}  // namespace
}  // namespace roslam::street
