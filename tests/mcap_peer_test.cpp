// SPDX-License-Identifier: BSD-3-Clause
// MCAP files against a reader and writer of others (tests/mcap_peer.mjs says how to install them).
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "roslam/recordings/mcap_writer.hpp"
#include "roslam/ros/recording_source.hpp"
#include "roslam/ros/ros_definitions.hpp"
#include "roslam/ros/ros_encoding.hpp"
#include "tests/mcap_writer.hpp"
#include "tests/program.hpp"
#include "tests/ros_writer.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kPackages = "ROSLAM_NODE_PACKAGES";
constexpr int kFrames = 10;
constexpr std::int64_t kBegin = 1700000000123456789;
constexpr std::int64_t kInterval = 100'000'000;

class McapPeer : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::getenv(kPackages) == nullptr)
      GTEST_SKIP() << kPackages << " is not set; see tests/mcap_peer.mjs";
    fs::create_directories(folder_);
    if (shell_in(folder_, "node --version").code != 0) GTEST_SKIP() << "node is not installed";
  }
  void TearDown() override { fs::remove_all(folder_); }

  // What the program prints.
  std::string peer(const std::string& arguments) const {
    const fs::path script = fs::path(ROSLAM_TEST_FILES).parent_path() / "mcap_peer.mjs";
    const Outcome outcome = shell_in(folder_, "node '" + script.string() + "' " + arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return outcome.out;
  }

  fs::path folder_ = scratch_path(), file_ = folder_ / "recording.mcap";
};

void expect_pattern(const Frame& frame, int i) {
  ASSERT_EQ(frame.colour.size(), cv::Size(64, 48));
  ASSERT_EQ(frame.depth.size(), cv::Size(64, 48));
  int different = 0;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const float depth = v == 0 ? 0.0F : 0.001F * static_cast<float>(1000 + 10 * i + u);
      const cv::Vec3b bgr(static_cast<std::uint8_t>(20 * i), static_cast<std::uint8_t>(5 * v),
                          static_cast<std::uint8_t>(4 * u));
      const bool is_same =
          frame.colour.at<cv::Vec3b>(v, u) == bgr && std::abs(frame.depth.at<float>(v, u) - depth) < 1e-6F;
      different += is_same ? 0 : 1;
    }
  }
  EXPECT_EQ(different, 0) << "pixels of frame " << i;
}

TEST_P(McapPeer, FilesOfAnotherWriterAreRead) {
  peer("write recording.mcap " + std::string(GetParam()));
  if (HasFailure()) return;
  RecordingSource source(file_, {}, {});
  const Camera& camera = source.camera();
  EXPECT_EQ(camera.fx, 60.0);
  EXPECT_EQ(camera.fy, 61.0);
  EXPECT_EQ(camera.cx, 31.5);
  EXPECT_EQ(camera.cy, 23.5);
  EXPECT_EQ(camera.distortion, (std::array<double, 8>{0.01, -0.02, 0.0003, 0.0004, 0.005}));
  ASSERT_TRUE(camera.imu);
  EXPECT_TRUE(camera.imu->T_camera_imu.translation().isApprox(Eigen::Vector3d(0.03, -0.01, 0.002)));
  std::size_t samples = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = source.next();
    ASSERT_TRUE(frame) << i;
    EXPECT_NEAR(frame->timestamp, 1e-9 * static_cast<double>(kBegin + i * kInterval), 1e-6);
    expect_pattern(*frame, i);
    EXPECT_EQ(frame->inertial.size(), i == 0 ? 1U : 20U) << i;
    for (const InertialSample& sample : frame->inertial) {
      const double n = static_cast<double>(samples++);
      EXPECT_NEAR(sample.timestamp, 1e-9 * static_cast<double>(kBegin) + 0.005 * n, 1e-6);
      EXPECT_TRUE(sample.turn_rate.isApprox(Eigen::Vector3d(0.001 * n, 0.2, -0.3)));
      EXPECT_TRUE(sample.acceleration.isApprox(Eigen::Vector3d(0.5, -9.7, 0.001 * n)));
    }
  }
  EXPECT_FALSE(source.next());
  EXPECT_TRUE(source.skipped().empty());
  EXPECT_TRUE(source.skipped_depth().empty());
}

// The files that other tests are made of.
TEST_P(McapPeer, ReadsTheFilesOfTheTests) {
  TestMcapOptions options(GetParam());
  options.chunk_bytes = 20000;
  TestMcapWriter writer(file_, options);
  const int image = writer.add_topic("/image", "sensor_msgs/msg/Image", ""),
            imu = writer.add_topic("/imu", "sensor_msgs/msg/Imu", "");
  std::size_t image_bytes = 0;
  for (int i = 0; i < kFrames; ++i) {
    const std::int64_t t = kBegin + i * kInterval;
    const auto message = ros::image(ros::Version::kRos2, t, "camera", "16UC1",
                                    cv::Mat(48, 64, CV_16UC1, cv::Scalar(1000 + i)));
    image_bytes += message.size();
    writer.write(image, t, message);
    writer.write(imu, t, ros::imu(ros::Version::kRos2, t, "imu", {0, 0, 1}, {0, 0, 9.8}));
  }
  writer.close();
  const json found = json::parse(peer("read recording.mcap"));
  EXPECT_EQ(found["topics"]["/image"]["messages"], kFrames);
  EXPECT_EQ(found["topics"]["/image"]["bytes"], image_bytes);
  EXPECT_EQ(found["topics"]["/image"]["type"], "sensor_msgs/msg/Image");
  EXPECT_EQ(found["topics"]["/image"]["begin"], std::to_string(kBegin));
  EXPECT_EQ(found["topics"]["/imu"]["messages"], kFrames);
  EXPECT_EQ(found["index"]["messages"], 2 * kFrames) << "by the index of the file";
  EXPECT_EQ(found["index"]["statistics"], 2 * kFrames);
  EXPECT_EQ(found["is_whole"], true);
}

// The files that roslam record and roslam export write: the peer parses the definitions in them, and decodes
// the messages by these.
TEST_P(McapPeer, ReadsTheFilesOfTheWriter) {
  McapWriterOptions options;
  options.chunk_bytes = 20000;
  options.compression = *compression_named(GetParam());
  McapWriter writer(file_, options);
  const auto topic = [&](const char* name, const std::string& type) {
    return writer.add_topic(name, type, ros_definition(type));
  };
  const int image = topic("/image", "sensor_msgs/msg/Image"),
            info = topic("/info", "sensor_msgs/msg/CameraInfo"), imu = topic("/imu", "sensor_msgs/msg/Imu"),
            tf = topic("/tf", "tf2_msgs/msg/TFMessage"),
            pose = topic("/pose", "geometry_msgs/msg/PoseStamped"),
            text = topic("/text", "std_msgs/msg/String");
  Camera camera;
  camera.set_lens("pinhole", {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8});
  RosTransform transform;
  transform.child = "child";
  for (int i = 0; i < kFrames; ++i) {
    const RosHeader header{kBegin + i * kInterval, "camera"};
    transform.header = header;
    writer.write(image, header.stamp, encode_image(header, cv::Mat(48, 64, CV_16UC1, cv::Scalar(1000 + i))));
    writer.write(info, header.stamp, encode_camera_info(header, camera));
    writer.write(imu, header.stamp, encode_imu({header, {0, 0, 1}, {0, 0, 9.8}}));
    writer.write(tf, header.stamp, encode_transforms({transform, transform}));
    writer.write(pose, header.stamp, encode_pose(transform));
    writer.write(text, header.stamp, encode_text("a text"));
  }
  writer.close();
  const json found = json::parse(peer("read recording.mcap"));
  EXPECT_EQ(found["index"]["messages"], 6 * kFrames);
  EXPECT_EQ(found["index"]["statistics"], 6 * kFrames);
  EXPECT_EQ(found["is_whole"], true);
  EXPECT_EQ(found["topics"].size(), 6U);
  for (const auto& [name, one] : found["topics"].items()) {
    EXPECT_EQ(one["messages"], kFrames) << name;
    EXPECT_TRUE(one.contains("last")) << name << one;
  }
}

INSTANTIATE_TEST_SUITE_P(Compressions, McapPeer, testing::Values("none", "lz4", "zstd"),
                         [](const auto& method) { return std::string(method.param); });

}  // namespace
}  // namespace roslam
