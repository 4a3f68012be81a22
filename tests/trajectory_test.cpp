// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/trajectory.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/geometry/alignment.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

class TrajectoryText : public testing::Test {
 protected:
  const fs::path file_ = scratch_path(".txt");

  TrajectoryFile read(const std::string& text) const {
    std::ofstream(file_, std::ios::binary) << text;
    return read_trajectory(file_);
  }

  void TearDown() override { fs::remove(file_); }

  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(TrajectoryText, ReadsNumbersInTheOrderOfTheFormat) {
  const auto read_file = read("1.5 1 2 3 0 0 0.6 0.8\n");
  ASSERT_EQ(read_file.trajectory.size(), 1u);
  EXPECT_EQ(read_file.skipped, 0u);
  const auto& [time, pose] = read_file.trajectory[0];
  EXPECT_EQ(time, 1.5);
  EXPECT_EQ(pose.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(pose.rotation().z(), 0.6, 1e-15);
  EXPECT_NEAR(pose.rotation().w(), 0.8, 1e-15);
}

TEST_F(TrajectoryText, ToleratesCommentsBlankLinesCommasAndWindowsLineEnds) {
  const auto read_file = read(
      "# a comment\r\n"
      "\r\n"
      "   \t \n"
      "  1,1,2,3,0,0,0,1\r\n"
      "2\t 1e0  +2 3.0 0 0 0 1   # remark\n"
      "3, 1, 2, 3, 0, 0, 0, 1\n"
      "  # indented comment\n"
      "4 1 2 3 0 0 0 1");  // no line end at the end
  EXPECT_EQ(read_file.trajectory.size(), 4u);
  EXPECT_EQ(read_file.skipped, 0u);
  for (const auto& pose : read_file.trajectory) {
    EXPECT_EQ(pose.T_world_camera.translation(), Eigen::Vector3d(1, 2, 3));
  }
}

TEST_F(TrajectoryText, NamesFileAndLineOfWhatIsNotEightNumbers) {
  for (const std::string line : {"2 1 2 3 0 0 0", "2 1 2 3 0 0 0 1 9", "2 1 2 3 0 0 0 one",
                                 "2 1 2 3 0 0 0 1x", "2 1 2 3 0 0 0 --1", "2 1 2 3 0 0 0 +-1", "hello"}) {
    const std::string message = refusal("# head\n1 0 0 0 0 0 0 1\n" + line + "\n");
    EXPECT_NE(message.find(file_.string() + ":3:"), std::string::npos) << line << " -> " << message;
  }
}

TEST_F(TrajectoryText, SkipsAndCountsValuesThatAreNotFinite) {
  const auto read_file = read(
      "1 0 0 0 0 0 0 1\n"
      "2 nan 0 0 0 0 0 1\n"
      "3 0 -inf 0 0 0 0 1\n"
      "4 0 0 0 NaN NaN NaN NaN\n"
      "nan 0 0 0 0 0 0 1\n"
      "5 1e999 0 0 0 0 0 1\n"
      "6 0 0 0 0 0 0 1\n");
  EXPECT_EQ(read_file.trajectory.size(), 2u);
  EXPECT_EQ(read_file.skipped, 5u);
}

TEST_F(TrajectoryText, NormalisesNearlyUnitQuaternionsAndSkipsOthers) {
  const auto read_file = read(
      "1 0 0 0 0 0 0 0.91\n"
      "2 0 0 0 0 0 0 1.09\n"
      "3 0 0 0 0 0 0 0.89\n"
      "4 0 0 0 0 0 0 1.11\n"
      "5 0 0 0 0 0 0 0\n"
      "6 0 0 0 0 0 0.63 0.84\n");  // 1.05 times (0.6, 0.8)
  ASSERT_EQ(read_file.trajectory.size(), 3u);
  EXPECT_EQ(read_file.skipped, 3u);
  for (const auto& pose : read_file.trajectory)
    EXPECT_NEAR(pose.T_world_camera.rotation().norm(), 1.0, 1e-15);
  EXPECT_NEAR(read_file.trajectory[2].T_world_camera.rotation().z(), 0.6, 1e-12);
}

TEST_F(TrajectoryText, SortsByTimeAndKeepsTheFirstOfRepeatedTimes) {
  const auto read_file = read(
      "3 3 0 0 0 0 0 1\n"
      "1 1 0 0 0 0 0 1\n"
      "2 2 0 0 0 0 0 1\n"
      "1 9 0 0 0 0 0 1\n"
      "3.0 9 0 0 0 0 0 1\n");
  ASSERT_EQ(read_file.trajectory.size(), 3u);
  EXPECT_EQ(read_file.skipped, 2u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read_file.trajectory[i].timestamp, static_cast<double>(i + 1));
    EXPECT_EQ(read_file.trajectory[i].T_world_camera.translation().x(), static_cast<double>(i + 1));
  }
}

TEST_F(TrajectoryText, RefusesWhatHoldsNoPose) {
  EXPECT_NE(refusal("").find("no pose"), std::string::npos);
  EXPECT_NE(refusal("# only a comment\n").find("no pose"), std::string::npos);
  EXPECT_NE(refusal("1 nan 0 0 0 0 0 1\n").find("no pose"), std::string::npos);
  EXPECT_THROW(read_trajectory("/no/such/file.txt"), InputError);
  EXPECT_THROW(read_trajectory(testing::TempDir()), InputError);
}

TEST_F(TrajectoryText, RoundTripsToTheWrittenDecimals) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  Trajectory trajectory;
  for (int i = 0; i < 100; ++i) {
    Vector6d tangent;
    for (int k = 0; k < 6; ++k) tangent[k] = normal(generator);
    trajectory.push_back({1305031229.0 + 0.033 * i, SE3::exp(tangent)});
  }
  write_trajectory(file_, trajectory);
  const auto read_file = read_trajectory(file_);
  ASSERT_EQ(read_file.trajectory.size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const auto& pose = read_file.trajectory[i];
    EXPECT_NEAR(pose.timestamp, trajectory[i].timestamp, 6e-7);
    EXPECT_LT((pose.T_world_camera.inverse() * trajectory[i].T_world_camera).log().norm(), 1e-8);
  }
  const std::string first = content(file_);
  write_trajectory(file_, trajectory);
  EXPECT_EQ(content(file_), first);
}

TEST_F(TrajectoryText, WritesTheSameBytesForTheSamePose) {
  const Eigen::Quaterniond q(-0.8, 0.0, 0.0, -0.6);
  write_trajectory(file_, {{1.0, SE3(q, {-1e-15, 0.25, -2.0})}});
  EXPECT_EQ(
      content(file_),
      "# timestamp tx ty tz qx qy qz qw\n"
      "1.000000 0.000000000 0.250000000 -2.000000000 0.000000000 0.000000000 0.600000000 0.800000000\n");
}

TEST_F(TrajectoryText, ReportsAFullDiskAndAMissingFolder) {
  const Trajectory trajectory{{1.0, SE3()}};
  if (fs::exists("/dev/full")) {
    EXPECT_THROW(write_trajectory("/dev/full", trajectory), OutputError);
  }
  EXPECT_THROW(write_trajectory("/no/such/folder/t.txt", trajectory), OutputError);
  EXPECT_THROW(write_trajectory(testing::TempDir(), trajectory), OutputError);
}

using Points = std::vector<Eigen::Vector3d>;

Points random_points(std::mt19937& generator, std::size_t count) {
  std::normal_distribution<double> normal;
  Points points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(normal(generator), 2 * normal(generator), normal(generator));
  return points;
}

double cost(const Alignment& alignment, const Points& source, const Points& target) {
  double sum = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) sum += (alignment * source[i] - target[i]).squaredNorm();
  return sum;
}

Eigen::Vector3d mean(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

// Horn 1987: the rotation is the eigenvector of a 4x4 matrix, found without any singular value decomposition.
Alignment horn(const Points& source, const Points& target, bool with_scale) {
  const Eigen::Vector3d from = mean(source);
  const Eigen::Vector3d to = mean(target);
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) s += (source[i] - from) * (target[i] - to).transpose();
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),   //
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),  //
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), -s(0, 0) - s(1, 1) + s(2, 2);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(n);
  const Eigen::Vector4d q = solver.eigenvectors().col(3);
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  double scale = 1.0;
  if (with_scale) {
    double across = 0.0;
    double spread = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i) {
      across += (target[i] - to).dot(rotation * (source[i] - from));
      spread += (source[i] - from).squaredNorm();
    }
    scale = across / spread;
  }
  return {scale, SE3(rotation, to - scale * (rotation * from)), true};
}

TEST(Alignment, AgreesWithHornsQuaternionMethodOnNoisyPoints) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal(0.0, 0.3);
  for (int trial = 0; trial < 50; ++trial) {
    const Points source = random_points(generator, 3 + static_cast<std::size_t>(trial));
    Vector6d tangent;
    for (int k = 0; k < 6; ++k) tangent[k] = 5.0 * normal(generator);
    Points target;
    for (const auto& point : source) {
      target.push_back(SE3::exp(tangent) * (1.7 * point) +
                       Eigen::Vector3d(normal(generator), normal(generator), normal(generator)));
    }
    for (const auto model : {AlignmentModel::kRigid, AlignmentModel::kSimilarity}) {
      const auto found = align_points(source, target, model);
      const Alignment expected = horn(source, target, model == AlignmentModel::kSimilarity);
      ASSERT_TRUE(found);
      EXPECT_TRUE(found->unique_rotation);
      EXPECT_NEAR(found->scale, expected.scale, 1e-9);
      EXPECT_LT((found->T_target_source.matrix() - expected.T_target_source.matrix()).norm(), 1e-8);
    }
  }
}

TEST(Alignment, NoSmallChangeIsBetter) {
  std::mt19937 generator(6);
  const Points source = random_points(generator, 12);
  const Points target = random_points(generator, 12);  // unrelated: a reflection would often fit better
  const auto found = align_points(source, target, AlignmentModel::kSimilarity);
  ASSERT_TRUE(found);
  const double least = cost(*found, source, target);
  for (int k = 0; k < 7; ++k) {
    for (const double step : {-1e-3, 1e-3}) {
      Alignment changed = *found;
      Vector6d tangent = Vector6d::Zero();
      if (k < 6) tangent[k] = step;
      if (k == 6) changed.scale += step;
      changed.T_target_source = changed.T_target_source * SE3::exp(tangent);
      EXPECT_GT(cost(changed, source, target), least) << k;
    }
  }
  EXPECT_NEAR(found->T_target_source.rotation().toRotationMatrix().determinant(), 1.0, 1e-12);
}

TEST(Alignment, FitsAStraightLineAndAHoverThoughNotUniquely) {
  const Points line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 0, 0}};
  const Points turned{{1, 1, 1}, {1, 2, 1}, {1, 3, 1}, {1, 6, 1}};
  const auto found = align_points(line, turned, AlignmentModel::kRigid);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->unique_rotation);
  EXPECT_LT(cost(*found, line, turned), 1e-20);

  const Points spot(4, Eigen::Vector3d(7, 8, 9));
  const auto hover = align_points(spot, turned, AlignmentModel::kRigid);
  ASSERT_TRUE(hover);
  EXPECT_FALSE(hover->unique_rotation);
  EXPECT_LT((*hover * spot[0] - mean(turned)).norm(), 1e-12);
  EXPECT_FALSE(align_points(spot, turned, AlignmentModel::kSimilarity));
  EXPECT_FALSE(align_points(turned, spot, AlignmentModel::kSimilarity));
}

TEST(Alignment, HasNoAnswerForTooFewUnequalOrUnusablePoints) {
  const Points two{{0, 0, 0}, {1, 0, 0}};
  const Points three{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  Points unusable = three;
  unusable[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(align_points(two, two, AlignmentModel::kRigid));
  EXPECT_FALSE(align_points(two, three, AlignmentModel::kRigid));
  EXPECT_FALSE(align_points(three, unusable, AlignmentModel::kRigid));
  EXPECT_FALSE(align_points({}, {}, AlignmentModel::kRigid));
}

// A camera that flies straight ahead and rolls: positions alone leave the turn about the path open.
TEST(PoseAlignment, RecoversAMotionFromAStraightPathAndFromOnePose) {
  Vector6d tangent;
  tangent << 1.0, -2.0, 0.5, 2.0, -1.0, 1.5;
  const SE3 motion = SE3::exp(tangent);
  std::vector<SE3> source, target;
  for (int i = 0; i < 10; ++i) {
    source.emplace_back(so3_exp({0.0, 0.0, 0.3 * i}), Eigen::Vector3d(0.0, 0.0, 0.2 * i));
    target.push_back(motion * source.back());
  }
  // The same rotation written the other way.
  target[4] = SE3::from_parts(Eigen::Quaterniond(-target[4].rotation().coeffs()), target[4].translation());
  const auto found = align_poses(source, target);
  ASSERT_TRUE(found);
  EXPECT_LT((found->inverse() * motion).log().norm(), 1e-9);
  const auto from_one = align_poses({source[3]}, {target[3]});
  ASSERT_TRUE(from_one);
  EXPECT_LT((from_one->inverse() * motion).log().norm(), 1e-9);
}

TEST(PoseAlignment, ErrorsThatCancelOutCostNothing) {
  std::vector<SE3> source, target;
  for (const double error : {0.1, -0.1}) {
    source.emplace_back(so3_exp({error, 0.0, 0.0}), Eigen::Vector3d(2.0 * error, 0.0, 0.0));
    target.emplace_back();
  }
  const auto found = align_poses(source, target);
  ASSERT_TRUE(found);
  EXPECT_LT(found->log().norm(), 1e-12);
}

TEST(PoseAlignment, HasNoAnswerForNoneUnequalOrUnusablePoses) {
  const SE3 unusable(Eigen::Quaterniond::Identity(),
                     Eigen::Vector3d(std::numeric_limits<double>::infinity(), 0, 0));
  EXPECT_FALSE(align_poses({}, {}));
  EXPECT_FALSE(align_poses({SE3()}, {}));
  EXPECT_FALSE(align_poses({SE3(), unusable}, {SE3(), SE3()}));
}

}  // namespace
}  // namespace roslam
