// SPDX-License-Identifier: BSD-3-Clause
// Poses of frames in map and odom, the growing path, and the stamps of an export, on runs with known content.
#include "recording/mcap_export.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "recording/display_messages.hpp"
#include "roslam/common/error.hpp"
#include "roslam/recordings/recording.hpp"
#include "tests/cdr_message.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/scratch.hpp"

namespace roslam::recording {
namespace {

SE3 pose(double turn, double x) { return {so3_exp({0.1 * turn, 0.0, turn}), {x, 0.5 * x, 0.1}}; }

double difference(const SE3& a, const SE3& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

// Camera poses at some times, odometry at others.
RunContents run_of(const std::vector<int>& with_pose, const std::vector<int>& with_odometry) {
  RunContents run;
  run.source.camera.T_body_camera = SE3(so3_exp({0.0, 0.3, 0.0}), {0.2, 0.0, -0.1});
  for (const int i : with_pose) run.trajectory.push_back({0.1 * i, pose(0.01 * i, 0.2 * i)});
  for (const int i : with_odometry) {
    Odometry odometry;
    odometry.timestamp = 0.1 * i;
    odometry.T_odom_body = pose(0.013 * i, 0.21 * i);  // drifts
    run.odometry.push_back(odometry);
  }
  return run;
}

TEST(PosesOfFrames, LeadFromTheMapToTheCamera) {
  const RunContents run = run_of({1, 2, 3, 5}, {2, 3, 4, 5, 6});
  const auto frames = poses_of_frames(run);
  ASSERT_EQ(frames.size(), 6U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FramePoses& frame = frames[i];
    EXPECT_EQ(frame.stamp, static_cast<std::int64_t>(i + 1) * 100'000'000);
    EXPECT_EQ(frame.T_map_odom.has_value(), frame.T_map_camera.has_value());
    if (frame.odometry) {
      EXPECT_EQ(difference(frame.T_odom_body, run.odometry[*frame.odometry].T_odom_body), 0.0);
    }
    if (frame.T_map_camera) {
      EXPECT_LT(difference(*frame.T_map_odom * frame.T_odom_body * run.source.camera.T_body_camera,
                           *frame.T_map_camera),
                1e-12);
    }
  }
  EXPECT_FALSE(frames[0].odometry);
  EXPECT_EQ(difference(*frames[0].T_map_odom, SE3()), 0.0);
  EXPECT_FALSE(frames[3].T_map_camera);
  EXPECT_FALSE(frames[5].T_map_camera);
}

TEST(PosesOfFrames, KeepOdomWhereThereIsNoOdometry) {
  const auto frames = poses_of_frames(run_of({1, 2, 3}, {1, 3}));
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(difference(*frames[1].T_map_odom, *frames[0].T_map_odom), 0.0);
  EXPECT_GT(difference(*frames[2].T_map_odom, *frames[0].T_map_odom), 0.001);
}

TEST(RosStamp, IsOfMicroseconds) {
  EXPECT_EQ(ros_stamp(0.0), 0);
  EXPECT_EQ(ros_stamp(0.0333334), 33'333'000);
  EXPECT_EQ(ros_stamp(1311868164.363181), 1311868164'363181'000);
  EXPECT_EQ(ros_stamp(0.9999999), 1'000'000'000);
  for (const double time : {-0.001, 2147483648.0, std::nan(""), 1e300})
    EXPECT_THROW(ros_stamp(time), InputError) << time;
}

TEST(McapExport, ThePathGrowsInFewMessages) {
  constexpr int kPoses = 20000;  // 2000 s
  std::vector<int> all;
  for (int i = 0; i < kPoses; ++i) all.push_back(i);
  const auto file = scratch_path(".mcap");
  McapExport out(file, run_of(all, {}));
  out.finish();
  const auto recording = open_recording(file);
  std::size_t messages = 0, poses = 0;
  for (const auto& message : read_all(*recording)) {
    if (message.topic != "/path") continue;
    ++messages;
    CdrMessage in(message.data);
    EXPECT_EQ(in.stamp(), message.time);
    in.text();
    poses = in.get<std::uint32_t>();
    EXPECT_TRUE(poses <= 1000 || messages > 100) << poses;
    std::int64_t last = -1;
    for (std::size_t i = 0; i < poses; ++i) {
      const std::int64_t stamp = in.stamp();
      EXPECT_GT(stamp, last);
      last = stamp;
      in.text();
      in.pose();
    }
    EXPECT_EQ(last, message.time);  // up to now
  }
  EXPECT_LE(messages, 102U);
  EXPECT_GE(messages, 100U);
  EXPECT_EQ(poses, static_cast<std::size_t>(kPoses));
  std::filesystem::remove(file);
}

TEST(McapExport, WithoutItsEndThereIsNoFile) {
  const auto file = scratch_path(".mcap");
  {
    const McapExport out(file, run_of({1, 2}, {}));
    EXPECT_FALSE(std::filesystem::exists(file));
    EXPECT_TRUE(std::filesystem::exists(file.string() + ".part"));
  }
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".part"));
  McapExportOptions options;
  options.jpeg_quality = 0;
  EXPECT_THROW(McapExport(file, run_of({1}, {}), options), OptionsError);
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".part"));
}

TEST(DisplayMessages, PointsArePackedAsThePointCloudLibraryDoes) {
  const std::vector<ColouredPoint> points{{{1.0F, 2.0F, 3.0F}, {10, 20, 30}},
                                          {{-1.0F, 0.0F, 0.5F}, {1, 2, 3}}};
  const RosMessage message = encode_points({5, "map"}, points);
  const std::string bytes(message.begin(), message.end());
  std::string expected;
  for (const float value : {1.0F, 2.0F, 3.0F}) expected.append(reinterpret_cast<const char*>(&value), 4);
  expected += std::string("\x0a\x14\x1e\0", 4);  // blue first, as 0x001e140a is little-endian
  EXPECT_NE(bytes.find(expected), std::string::npos);
  CdrMessage none([&] {
    const RosMessage empty = encode_points({5, "map"}, {});
    return std::string(empty.begin(), empty.end());
  }());
  EXPECT_EQ(none.stamp(), 5);
}

}  // namespace
}  // namespace roslam::recording
