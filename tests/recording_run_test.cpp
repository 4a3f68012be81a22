// SPDX-License-Identifier: BSD-3-Clause
// A flight is the same from a folder and from recordings of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "roslam/datasets/tum_source.hpp"
#include "roslam/options/options.hpp"
#include "roslam/ros/recording_source.hpp"
#include "roslam/slam/run.hpp"
#include "tests/recording_writers.hpp"
#include "tests/ros_writer.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using ros::Bytes;
using ros::Version;

constexpr std::size_t kFrames = 40;

Bytes png_of(const cv::Mat& image) {
  Bytes bytes;
  cv::imencode(".png", image, bytes);
  return bytes;
}

std::int64_t nanoseconds_of(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e6)) * 1000;
}

// The images of the folder's first frames, as taken: colour as decoded, depth as 16 bit.
void record(const fs::path& folder, const Camera& camera, Version version, bool is_compressed,
            RecordingWriter& writer) {
  const std::string slash = version == Version::kRos1 ? "/" : "/msg/";
  const std::string image = "sensor_msgs" + slash + (is_compressed ? "CompressedImage" : "Image");
  const std::string info = "sensor_msgs" + slash + "CameraInfo";
  const std::string colour_name = "/camera/color/image_raw",
                    depth_name = "/camera/aligned_depth_to_color/image_raw";
  const int colour = writer.add_topic(colour_name + (is_compressed ? "/compressed" : ""), image, "");
  const int depth = writer.add_topic(depth_name + (is_compressed ? "/compressedDepth" : ""), image, "");
  const int colour_info = writer.add_topic("/camera/color/camera_info", info, "");
  const int depth_info = writer.add_topic("/camera/aligned_depth_to_color/camera_info", info, "");
  TumSource source(folder, camera);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto frame = source.next();
    ASSERT_TRUE(frame);
    const std::int64_t t = nanoseconds_of(frame->timestamp);
    ASSERT_EQ(seconds_of(t), frame->timestamp);
    const cv::Mat raw = cv::imread(source.depth_file(i)->string(), cv::IMREAD_UNCHANGED);
    writer.write(colour_info, t, ros::camera_info(version, t, "optical", camera));
    writer.write(depth_info, t, ros::camera_info(version, t, "optical", camera));
    if (!is_compressed) {
      writer.write(colour, t, ros::image(version, t, "optical", "bgr8", frame->colour));
      writer.write(depth, t, ros::image(version, t, "optical", "16UC1", raw));
      continue;
    }
    Bytes compressed(12, 0);
    const Bytes png = png_of(raw);
    compressed.insert(compressed.end(), png.begin(), png.end());
    writer.write(
        colour, t,
        ros::compressed_image(version, t, "optical", "bgr8; png compressed bgr8", png_of(frame->colour)));
    writer.write(depth, t,
                 ros::compressed_image(version, t, "optical", "16UC1; compressedDepth png", compressed));
  }
  writer.close();
}

Trajectory flown(FrameSource& source) {
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(source.camera(), options);
  for (std::size_t i = 0; i < kFrames; ++i)
    if (const auto frame = source.next()) slam.process(*frame);
  slam.finish();
  return slam.trajectory();
}

TEST(RecordingRun, IsBitIdenticalToThatOfTheFolder) {
  const fs::path folder = fs::path(ROSLAM_TEST_DATA) / "slam/kitchen";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is absent";
  Camera camera;  // as a calibration in a recording has it: intrinsics only
  camera.fx = camera.fy = 525.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.depth_units_per_metre = 1000.0;
  camera.fps = 30.0;
  TumSource source(folder, camera);
  const Trajectory expected = flown(source);
  ASSERT_EQ(expected.size(), kFrames);
  const fs::path scratch = scratch_path();
  fs::create_directories(scratch);
  struct Case {
    const char* file;
    Version version;
    bool is_compressed;
    std::function<std::unique_ptr<RecordingWriter>(const fs::path&)> make;
  };
  const auto bag = [](const char* method) {
    return [method](const fs::path& file) {
      ChunkOptions options;
      options.compression = method;
      return std::make_unique<BagWriter>(file, options);
    };
  };
  const auto mcap = [](const char* method) {
    return [method](const fs::path& file) {
      return std::make_unique<TestMcapWriter>(file, TestMcapOptions(method));
    };
  };
  const auto db3 = [](const fs::path& file) { return std::make_unique<Db3Writer>(file); };
  const std::vector<Case> cases{{"raw.bag", Version::kRos1, false, bag("lz4")},
                                {"compressed.bag", Version::kRos1, true, bag("none")},
                                {"raw.db3", Version::kRos2, false, db3},
                                {"raw.mcap", Version::kRos2, false, mcap("zstd")},
                                {"compressed.mcap", Version::kRos2, true, mcap("")}};
  for (const Case& tested : cases) {
    const fs::path file = scratch / tested.file;
    const auto writer = tested.make(file);
    record(folder, camera, tested.version, tested.is_compressed, *writer);
    RecordingSource recorded(file, {}, {});
    EXPECT_EQ(recorded.camera().fps, 30.0);
    const Trajectory found = flown(recorded);
    ASSERT_EQ(found.size(), expected.size()) << tested.file;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].timestamp, expected[i].timestamp) << tested.file;
      EXPECT_TRUE(found[i].T_world_camera == expected[i].T_world_camera) << tested.file << " frame " << i;
    }
    fs::remove(file);
  }
  fs::remove_all(scratch);
}

}  // namespace
}  // namespace roslam
