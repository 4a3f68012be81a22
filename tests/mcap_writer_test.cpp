// SPDX-License-Identifier: BSD-3-Clause
// MCAP files and ROS 2 messages that are written, read back.
#include "roslam/recordings/mcap_writer.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/recordings/recording.hpp"
#include "roslam/ros/ros_definitions.hpp"
#include "roslam/ros/ros_encoding.hpp"
#include "roslam/ros/ros_images.hpp"
#include "tests/file_size_limit.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

std::vector<Message> messages_of(std::size_t count, std::size_t bytes) {
  std::mt19937 random(7);
  std::vector<Message> messages;
  for (std::size_t i = 0; i < count; ++i) {
    Message message{i % 3 == 0 ? "/a" : "/b", static_cast<std::int64_t>(i) * 10'000'000,
                    std::string(bytes, '\0')};
    for (char& c : message.data) c = static_cast<char>(random() % 7);
    messages.push_back(std::move(message));
  }
  return messages;
}

void write(McapWriter& writer, const std::vector<Message>& messages) {
  const int a = writer.add_topic("/a", "std_msgs/msg/String", ros_definition("std_msgs/msg/String"));
  const int b = writer.add_topic("/b", "std_msgs/msg/String", ros_definition("std_msgs/msg/String"));
  for (const Message& message : messages)
    writer.write(message.topic == "/a" ? a : b, message.time, bytes_of(message.data));
}

TEST(McapWriter, IsReadBackWithEachCompression) {
  const auto expected = messages_of(300, 1000);
  for (const Compression method : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const fs::path file = scratch_path(".mcap");
    McapWriterOptions options;
    options.chunk_bytes = 20000;
    options.compression = method;
    McapWriter writer(file, options);
    write(writer, expected);
    writer.close();
    EXPECT_EQ(writer.bytes(), fs::file_size(file));
    const auto recording = open_recording(file);
    EXPECT_EQ(recording->notes(), (std::map<std::string, std::size_t>{}));
    ASSERT_EQ(recording->topics().size(), 2U);
    EXPECT_EQ(recording->topics()[0].type, "std_msgs/msg/String");
    EXPECT_EQ(recording->topics()[0].encoding, "cdr");
    EXPECT_EQ(recording->topics()[0].definition, "string data\n");
    EXPECT_EQ(recording->topics()[0].messages, 100U);
    EXPECT_EQ(recording->topics()[1].messages, 200U);
    EXPECT_EQ(recording->time_range(), std::pair(expected.front().time, expected.back().time));
    EXPECT_EQ(read_all(*recording), expected);
    EXPECT_EQ(recording->notes(), (std::map<std::string, std::size_t>{}));
  }
}

TEST(McapWriter, LosesTheLastChunkOnlyWhereItIsNotClosed) {
  const auto expected = messages_of(300, 1000);
  const fs::path file = scratch_path(".mcap"), copy = scratch_path("_copy.mcap");
  McapWriterOptions options;
  options.chunk_bytes = 20000;
  McapWriter writer(file, options);
  write(writer, expected);
  fs::copy_file(file, copy, fs::copy_options::overwrite_existing);  // as if the program was killed here
  const auto recording = open_recording(copy);
  const auto messages = read_all(*recording);
  ASSERT_GE(messages.size(), 300U - 21U);
  EXPECT_TRUE(std::equal(messages.begin(), messages.end(), expected.begin()));
  EXPECT_FALSE(recording->notes().empty());
}

TEST(McapWriter, EndsAChunkAfterATime) {
  const fs::path file = scratch_path(".mcap");
  McapWriterOptions options;
  options.chunk_time = 50'000'000;
  McapWriter writer(file, options);
  write(writer, messages_of(300, 10));
  EXPECT_GE(read_all(*open_recording(file)).size(), 300U - 7U);
}

TEST(McapWriter, StaysReadableOnAFullDisk) {
  const auto expected = messages_of(300, 1000);
  const fs::path file = scratch_path(".mcap");
  McapWriterOptions options;
  options.chunk_bytes = 20000;
  options.compression = Compression::kNone;
  std::size_t written = 0;
  {
    McapWriter writer(file, options);
    const int a = writer.add_topic("/a", "std_msgs/msg/String", "string data\n");
    {
      const FileSizeLimit full(100000);
      EXPECT_THROW(for (; written < expected.size(); ++written)
                       writer.write(a, expected[written].time, bytes_of(expected[written].data)),
                   OutputError);
    }
    // There is room again: the file goes on, with a description of the topic.
    for (std::size_t i = 200; i < 300; ++i) writer.write(a, expected[i].time, bytes_of(expected[i].data));
    writer.close();
  }
  const auto recording = open_recording(file);
  const auto messages = read_all(*recording);
  EXPECT_EQ(recording->topics()[0].messages, messages.size());
  ASSERT_GT(messages.size(), 60U + 100U);
  ASSERT_LT(messages.size(), written + 100U);
  EXPECT_EQ(messages.back().data, expected.back().data);
  EXPECT_EQ(messages.front().data, expected.front().data);
}

TEST(McapWriter, RefusesWhatCannotBe) {
  EXPECT_THROW(McapWriter("/nowhere/at/all.mcap"), OutputError);
  McapWriterOptions options;
  options.compression = Compression::kBz2;  // which MCAP does not have
  EXPECT_THROW(McapWriter(scratch_path(".mcap"), options), InputError);
  McapWriter writer(scratch_path(".mcap"));
  EXPECT_THROW(writer.write(0, 0, {}), UsageError);
  const int topic = writer.add_topic("/a", "std_msgs/msg/String", "");
  EXPECT_THROW(writer.write(topic, -1, {}), UsageError);
  writer.close();
  EXPECT_THROW(writer.write(topic, 0, {}), UsageError);
}

TEST(McapWriter, AnEmptyFileIsWhole) {
  const fs::path file = scratch_path(".mcap");
  McapWriter(file).close();
  const auto recording = open_recording(file);
  EXPECT_TRUE(recording->topics().empty());
  EXPECT_FALSE(recording->next());
}

TEST(RosDefinitions, HaveAllTypesTheyUse) {
  const std::string odometry = ros_definition("nav_msgs/msg/Odometry");
  for (const char* part : {"float64[36] covariance\n", "MSG: geometry_msgs/Twist\n", "MSG: std_msgs/Header\n",
                           "MSG: builtin_interfaces/Time\nint32 sec\n"})
    EXPECT_NE(odometry.find(part), std::string::npos) << part;
  for (const char* type : {"sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage",
                           "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu", "sensor_msgs/msg/PointCloud2",
                           "nav_msgs/msg/Path", "tf2_msgs/msg/TFMessage", "geometry_msgs/msg/PoseStamped"})
    EXPECT_FALSE(ros_definition(type).empty()) << type;
  EXPECT_THROW(ros_definition("std_msgs/msg/Nothing"), UsageError);
}

constexpr std::int64_t kStamp = 1'700'000'000'123'456'789;

TEST(RosEncoding, ImagesAreReadBack) {
  cv::Mat whole(50, 70, CV_8UC3);
  cv::randu(whole, 0, 255);
  const cv::Mat part = whole(cv::Rect(3, 4, 41, 31));  // rows that do not follow each other in memory
  const RosMessage colour = encode_image({kStamp, "optical"}, part);
  const RosImage image = decode_image(colour, RosEncoding::kCdr);
  EXPECT_EQ(image.header.stamp, kStamp);
  EXPECT_EQ(image.header.frame, "optical");
  EXPECT_EQ(cv::norm(colour_pixels(image), part, cv::NORM_INF), 0.0);
  cv::Mat metres(20, 30, CV_32FC1);
  cv::randu(metres, 0.1, 5.0);
  const RosMessage depth = encode_image({kStamp, ""}, metres);
  EXPECT_EQ(cv::norm(depth_pixels(decode_image(depth, RosEncoding::kCdr), 1.0), metres, cv::NORM_INF), 0.0);
  const RosMessage raw = encode_image({kStamp, ""}, cv::Mat(4, 4, CV_16UC1, cv::Scalar(1500)));
  EXPECT_FLOAT_EQ(depth_pixels(decode_image(raw, RosEncoding::kCdr), 1000.0).at<float>(1, 1), 1.5F);
  EXPECT_THROW(encode_image({kStamp, ""}, cv::Mat(4, 4, CV_64FC1)), InputError);
  const std::vector<std::uint8_t> jpeg{1, 2, 3};
  const RosMessage compressed = encode_compressed_image({kStamp, "o"}, "jpeg", jpeg);
  const RosImage packed = decode_compressed_image(compressed, RosEncoding::kCdr);
  EXPECT_EQ(packed.encoding, "jpeg");
  EXPECT_TRUE(std::equal(packed.data.begin(), packed.data.end(), jpeg.begin(), jpeg.end()));
}

TEST(RosEncoding, CalibrationsAreReadBack) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500.123456789012;
  camera.fy = 501.1;
  camera.cx = 319.7;
  camera.cy = 239.3;
  const std::vector<std::pair<const char*, std::vector<double>>> lenses{
      {"pinhole", {0.1, -0.2, 1e-3, 2e-3, 0.05}},
      {"pinhole", {0.1, -0.2, 1e-3, 2e-3, 0.05, 0.01, 0.02, 0.03}},
      {"fisheye", {0.01, -0.02, 0.003, -0.0004}}};
  for (const auto& [model, coefficients] : lenses) {
    camera.set_lens(model, coefficients);
    const RosMessage message = encode_camera_info({kStamp, "o"}, camera);
    const Camera read = camera_of(decode_camera_info(message, RosEncoding::kCdr));
    EXPECT_EQ(read.fx, camera.fx);
    EXPECT_EQ(read.cy, camera.cy);
    EXPECT_EQ(read.model, camera.model);
    EXPECT_EQ(read.coefficients(), camera.coefficients());
    const Camera rectified = camera_of(decode_camera_info(message, RosEncoding::kCdr), true);
    EXPECT_EQ(rectified.fx, camera.fx);
  }
}

TEST(RosEncoding, SamplesAndPosesAreReadBack) {
  RosImu imu;
  imu.header = {kStamp, "imu"};
  imu.turn_rate = {0.1, 0.2, 0.3};
  imu.acceleration = {1.0, 2.0, 9.8};
  const RosImu read = decode_imu(encode_imu(imu), RosEncoding::kCdr);
  EXPECT_EQ(read.turn_rate, imu.turn_rate);
  EXPECT_EQ(read.acceleration, imu.acceleration);
  EXPECT_EQ(read.header.stamp, kStamp);
  const SE3 pose(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.0, 2.0, 3.0});
  std::vector<RosTransform> transforms(2);
  transforms[0].header = {-1'500'000'000, "map"};
  transforms[0].child = "odom";
  transforms[0].T_parent_child = pose;
  transforms[1].header = {kStamp, "odom"};
  transforms[1].child = "base_link";
  transforms[1].T_parent_child = pose.inverse();
  const auto tf = decode_transforms("tf2_msgs/TFMessage", encode_transforms(transforms), RosEncoding::kCdr);
  ASSERT_TRUE(tf);
  ASSERT_EQ(tf->size(), 2U);
  EXPECT_EQ(tf->front().child, "odom");
  EXPECT_EQ(tf->front().header.stamp, -1'500'000'000);
  EXPECT_TRUE(tf->back().T_parent_child.matrix().isApprox(pose.inverse().matrix(), 1e-15));
  const auto stamped =
      decode_transforms("geometry_msgs/PoseStamped", encode_pose(transforms.front()), RosEncoding::kCdr);
  ASSERT_TRUE(stamped);
  EXPECT_EQ(stamped->front().header.frame, "map");
  const RosMessage text = encode_text("a: 1\n");
  EXPECT_EQ(RosReader(text, RosEncoding::kCdr).text(), "a: 1\n");
}

TEST(RosEncoding, TimesAreNearestNanoseconds) {
  EXPECT_EQ(nanoseconds_of(1305031102.175304), 1305031102175304000);
  EXPECT_EQ(nanoseconds_of(-0.25), -250'000'000);
  EXPECT_EQ(nanoseconds_of(1.0 / 30.0), 33'333'333);
  EXPECT_EQ(nanoseconds_of(2.0 / 3.0), 666'666'667);
  EXPECT_EQ(nanoseconds_of(0.9999999999), 1'000'000'000);
  EXPECT_EQ(nanoseconds_of(0.0), 0);
  EXPECT_EQ(nanoseconds_of(1e-12), 0);
  for (const std::int64_t time : {kStamp, std::int64_t{33'333'333}, std::int64_t{-999'999'999}}) {
    EXPECT_NEAR(static_cast<double>(nanoseconds_of(seconds_of(time)) - time), 0.0, 200.0);
    EXPECT_EQ(seconds_of(nanoseconds_of(seconds_of(time))), seconds_of(time));
  }
  EXPECT_THROW(nanoseconds_of(1e12), InputError);
  EXPECT_THROW(nanoseconds_of(std::nan("")), InputError);
}

}  // namespace
}  // namespace roslam
