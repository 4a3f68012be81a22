// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/recording_source.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "roslam/common/error.hpp"
#include "roslam/sensors/counts.hpp"
#include "tests/recording_writers.hpp"
#include "tests/ros_writer.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using ros::Bytes;
using ros::Version;

constexpr std::int64_t kMillisecond = 1000000;
constexpr std::int64_t kFrame = 100 * kMillisecond;  // 10 Hz
constexpr std::int64_t kBegin = 1700000000123456789;

Camera small_camera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  return camera;
}

cv::Mat colour_image(int i) { return cv::Mat(48, 64, CV_8UC3, cv::Scalar(i, 2 * i, 200)); }
cv::Mat depth_image(int i) { return cv::Mat(48, 64, CV_16UC1, cv::Scalar(1000 + i)); }

class RecordingFrames : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    writer_ = std::make_unique<BagWriter>(file_, ChunkOptions{});
  }
  void TearDown() override { fs::remove_all(folder_); }

  int topic(const std::string& name, const std::string& type) { return writer_->add_topic(name, type, ""); }

  void put(int topic, std::int64_t time, const Bytes& message) { writer_->write(topic, time, message); }

  // A camera with registered depth, as drivers name it.
  void add_camera(int frames) {
    const int colour = topic("/camera/color/image_raw", "sensor_msgs/Image");
    const int depth = topic("/camera/aligned_depth_to_color/image_raw", "sensor_msgs/Image");
    const int info = topic("/camera/color/camera_info", "sensor_msgs/CameraInfo");
    const int depth_info = topic("/camera/aligned_depth_to_color/camera_info", "sensor_msgs/CameraInfo");
    for (int i = 0; i < frames; ++i) {
      const std::int64_t t = kBegin + i * kFrame;
      put(info, t, ros::camera_info(kVersion, t, "optical", small_camera()));
      put(depth_info, t, ros::camera_info(kVersion, t, "optical", small_camera()));
      put(colour, t, ros::image(kVersion, t, "optical", "bgr8", colour_image(i)));
      put(depth, t + 5 * kMillisecond,
          ros::image(kVersion, t + 5 * kMillisecond, "optical", "16UC1", depth_image(i)));
    }
  }

  std::unique_ptr<RecordingSource> open(const RecordingChoice& choice = {},
                                        const std::optional<Camera>& camera = {}) {
    writer_->close();
    return std::make_unique<RecordingSource>(file_, choice, camera);
  }

  void expect_refused(const std::vector<std::string>& words, const RecordingChoice& choice = {},
                      const std::optional<Camera>& camera = {}) {
    try {
      open(choice, camera);
      ADD_FAILURE() << "was opened";
    } catch (const Error& error) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(file_.string()), std::string::npos) << error.what();
    }
  }

  static std::vector<Frame> all(RecordingSource& source) {
    std::vector<Frame> frames;
    while (auto frame = source.next()) frames.push_back(std::move(*frame));
    return frames;
  }

  static constexpr Version kVersion = Version::kRos1;
  const fs::path folder_ = scratch_path();
  const fs::path file_ = folder_ / "flight.bag";
  std::unique_ptr<RecordingWriter> writer_;
};

TEST_F(RecordingFrames, OfDriversNeedNoCameraFile) {
  add_camera(12);
  const auto source = open();
  EXPECT_EQ(source->camera().fx, 60.0);
  EXPECT_EQ(source->camera().fps, 10.0);
  EXPECT_EQ(source->camera().depth_units_per_metre, 1000.0);
  EXPECT_EQ(source->size(), 12U);
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 12U);
  for (int i = 0; i < 12; ++i) {
    const Frame& frame = frames[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.index, static_cast<std::size_t>(i));
    EXPECT_EQ(frame.timestamp, seconds_of(kBegin + i * kFrame));
    EXPECT_EQ(cv::norm(frame.colour, colour_image(i), cv::NORM_INF), 0.0);
    ASSERT_FALSE(frame.depth.empty());
    EXPECT_FLOAT_EQ(frame.depth.at<float>(3, 3), 0.001F * static_cast<float>(1000 + i));
  }
  EXPECT_TRUE(source->skipped().empty());
  EXPECT_TRUE(source->skipped_depth().empty());
}

TEST_F(RecordingFrames, ArePairedByTheirStampsNotByWhenTheyWereRecorded) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  // Depth is recorded 2 frames late, and the third depth image is missing.
  for (int i = 0; i < 12; ++i) {
    if (i < 10)
      put(colour, kBegin + i * kFrame, ros::image(kVersion, i * kFrame, "", "bgr8", colour_image(i)));
    const int late = i - 2;
    if (late >= 0 && late != 3)
      put(depth, kBegin + i * kFrame + 1,
          ros::image(kVersion, late * kFrame + 40 * kMillisecond, "", "16UC1", depth_image(late)));
  }
  const auto source = open({}, small_camera());
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    const cv::Mat& image = frames[static_cast<std::size_t>(i)].depth;
    ASSERT_EQ(image.empty(), i == 3) << i;
    if (i != 3) {
      EXPECT_FLOAT_EQ(image.at<float>(0, 0), 0.001F * static_cast<float>(1000 + i));
    }
  }
  EXPECT_EQ(source->skipped_depth(), (Counts{{"no depth image near in time: the nearest is 60 ms from the "
                                              "colour image, at most 50 ms is taken as one moment",
                                              1}}));
}

TEST_F(RecordingFrames, SayHowFarTheNearestDepthImageIs) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  for (int i = 0; i < 10; ++i) {
    const std::int64_t t = kBegin + i * kFrame;
    put(colour, t, ros::image(kVersion, t, "", "bgr8", colour_image(i)));
    if (i == 4) put(depth, t + 1, ros::image(kVersion, t, "", "16UC1", depth_image(i)));
  }
  const auto source = open({}, small_camera());
  EXPECT_EQ(all(*source).size(), 10U);
  EXPECT_EQ(source->skipped_depth(),
            (Counts{{"no depth image near in time: the nearest is 100 to 500 ms from "
                     "the colour image, at most 50 ms is taken as one moment",
                     9}}));
}

TEST_F(RecordingFrames, OfTwiceTheRateShareNoDepthImage) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  for (int i = 0; i < 20; ++i) {
    const std::int64_t t = i * kFrame;
    put(colour, t, ros::image(kVersion, t, "", "bgr8", colour_image(i)));
    if (i % 2 == 0)
      put(depth, t + 1, ros::image(kVersion, t + 10 * kMillisecond, "", "16UC1", depth_image(i)));
  }
  const auto source = open({}, small_camera());
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 20U);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].depth.empty(), i % 2 == 1) << i;
}

TEST_F(RecordingFrames, RegisterDepthOfAnotherCameraByTf) {
  Camera depth_camera = small_camera();
  depth_camera.fx = depth_camera.fy = 40.0;
  const int tf = topic("/tf_static", "tf2_msgs/TFMessage");
  const SE3 T_colour_depth(Eigen::Quaterniond::Identity(), {0.05, 0.0, 0.01});
  const SE3 T_link_colour(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY())),
                          {0.1, 0.2, 0.3});
  put(tf, 0,
      ros::tf(kVersion, 0,
              {{"link", "colour", T_link_colour}, {"link", "depth", T_link_colour * T_colour_depth}}));
  const int colour = topic("/camera/color/image_raw", "sensor_msgs/Image");
  const int colour_info = topic("/camera/color/camera_info", "sensor_msgs/CameraInfo");
  const int depth = topic("/camera/depth/image_rect_raw", "sensor_msgs/Image");
  const int depth_info = topic("/camera/depth/camera_info", "sensor_msgs/CameraInfo");
  for (int i = 0; i < 8; ++i) {
    const std::int64_t t = i * kFrame;
    put(colour_info, t, ros::camera_info(kVersion, t, "colour", small_camera()));
    put(depth_info, t, ros::camera_info(kVersion, t, "depth", depth_camera));
    put(colour, t, ros::image(kVersion, t, "colour", "rgb8", colour_image(i)));
    put(depth, t, ros::image(kVersion, t, "depth", "16UC1", cv::Mat(48, 64, CV_16UC1, cv::Scalar(2000))));
  }
  const auto source = open();
  ASSERT_TRUE(source->streams().T_colour_depth);
  EXPECT_LT((source->streams().T_colour_depth->inverse() * T_colour_depth).log().norm(), 1e-9);
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 8U);
  EXPECT_FLOAT_EQ(frames[0].depth.at<float>(24, 32), 2.01F)
      << "the wall is 1 cm farther from the colour camera";
  EXPECT_EQ(
      source->notes().count("depth images are registered to colour by the calibrations of the recording"),
      1U);
}

TEST_F(RecordingFrames, KeepDepthThatIsRegisteredWhateverTheCameraOfTheUser) {
  add_camera(6);
  Camera better = small_camera();
  better.fx = better.fy = 57.0;
  better.set_lens("pinhole", {0.1, -0.05, 0.001, 0.0, 0.0});
  better.depth_units_per_metre = 1000.0;
  const auto source = open({}, better);
  EXPECT_FALSE(source->streams().T_colour_depth);
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_LT(cv::norm(frames[2].depth, cv::Mat(48, 64, CV_32FC1, cv::Scalar(1.002)), cv::NORM_INF), 1e-6)
      << "as recorded";
}

TEST_F(RecordingFrames, CarryInertialSamplesAndTruth) {
  add_camera(10);
  const int tf = topic("/tf_static", "tf2_msgs/TFMessage"), imu = topic("/imu/data", "sensor_msgs/Imu"),
            truth = topic("/vicon/odom", "nav_msgs/Odometry");
  const SE3 T_base_optical = forward_camera();
  const SE3 T_base_imu(Eigen::Quaterniond::Identity(), {0.02, 0.0, 0.0});
  put(tf, kBegin, ros::tf(kVersion, 0, {{"base", "optical", T_base_optical}, {"base", "imu", T_base_imu}}));
  const auto body = [](double seconds) {
    return SE3(Eigen::Quaterniond::Identity(), {seconds, 2.0 * seconds, 0.0});
  };
  for (int k = -10; k < 110; ++k) {
    const std::int64_t t = kBegin + k * 10 * kMillisecond;
    put(imu, t, ros::imu(kVersion, t, "imu", {0.01 * k, 0, 0}, {0, 0, 9.8}));
    put(truth, t, ros::odometry(kVersion, t, "world", "base", body(0.01 * k)));
  }
  const auto source = open();
  ASSERT_TRUE(source->camera().imu);
  EXPECT_LT(
      (source->camera().imu->T_camera_imu.inverse() * T_base_optical.inverse() * T_base_imu).log().norm(),
      1e-9);
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 10U);
  EXPECT_EQ(frames[5].inertial.size(), 10U);
  EXPECT_NEAR(frames[5].inertial.back().turn_rate.x(), 0.5, 1e-12);
  ASSERT_TRUE(frames[5].T_world_camera);
  EXPECT_LT((frames[5].T_world_camera->inverse() * body(0.5) * T_base_optical).log().norm(), 1e-6);
}

TEST_F(RecordingFrames, BeginASegmentWhereTheClockRestarts) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  for (int i = 0; i < 20; ++i) {
    const std::int64_t t = (i < 10 ? 100 + i : i - 10) * kFrame;
    put(colour, i * kFrame, ros::image(kVersion, t, "", "bgr8", colour_image(i)));
    put(depth, i * kFrame + 1, ros::image(kVersion, t, "", "16UC1", depth_image(i)));
  }
  const auto source = open({}, small_camera());
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 20U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].segment, i < 10 ? 0 : 1);
    ASSERT_FALSE(frames[i].depth.empty()) << i;
    EXPECT_FLOAT_EQ(frames[i].depth.at<float>(0, 0), 0.001F * static_cast<float>(1000 + i));
  }
}

TEST_F(RecordingFrames, AStampFromTheFutureCostsOneImage) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  for (int i = 0; i < 30; ++i) {
    const std::int64_t t = kBegin + i * kFrame;
    put(colour, i * kFrame,
        ros::image(kVersion, t + (i == 7 ? 100 * kFrame : 0), "", "bgr8", colour_image(i)));
    put(depth, i * kFrame + 1,
        ros::image(kVersion, t + (i == 15 ? 1000 * kFrame : 0), "", "16UC1", depth_image(i)));
  }
  const auto source = open({}, small_camera());
  const auto frames = all(*source);
  ASSERT_GE(frames.size(), 29U);
  std::size_t with_depth = 0;
  for (const Frame& frame : frames) {
    EXPECT_EQ(frame.segment, 0);
    if (frame.depth.empty()) continue;
    ++with_depth;
    EXPECT_FLOAT_EQ(frame.depth.at<float>(0, 0), 0.001F * static_cast<float>(1000 + frame.index));
  }
  EXPECT_GE(with_depth, 28U);
}

TEST_F(RecordingFrames, OutOfOrderAreSkippedAndCounted) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  for (int i = 0; i < 10; ++i) {
    const std::int64_t t = i * kFrame - (i == 5 ? 150 * kMillisecond : 0);
    put(colour, i * kFrame, ros::image(kVersion, t + kBegin, "", "bgr8", colour_image(i)));
    put(depth, i * kFrame, ros::image(kVersion, t + kBegin, "", "16UC1", depth_image(i)));
  }
  const auto source = open({}, small_camera());
  EXPECT_EQ(all(*source).size(), 9U);
  EXPECT_EQ(source->skipped().size(), 1U);
}

TEST_F(RecordingFrames, ThatAreDamagedAreSkippedAndCounted) {
  const int colour = topic("/rgb/compressed", "sensor_msgs/CompressedImage"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  Bytes png;
  cv::imencode(".png", colour_image(1), png);
  for (int i = 0; i < 10; ++i) {
    const std::int64_t t = i * kFrame;
    put(colour, t, ros::compressed_image(kVersion, t, "", "png", i == 4 ? Bytes{1, 2, 3} : png));
    Bytes image = ros::image(kVersion, t, "", "16UC1", depth_image(i));
    if (i == 6) image.resize(image.size() / 2);
    put(depth, t, image);
  }
  const auto source = open({}, small_camera());
  const auto frames = all(*source);
  ASSERT_EQ(frames.size(), 9U);
  EXPECT_EQ(source->skipped().at("compressed image is neither JPEG nor PNG"), 1U);
  EXPECT_EQ(source->skipped_depth().at("message is truncated"), 1U);
}

TEST_F(RecordingFrames, WithoutImagesAreRefused) {
  put(topic("/chatter", "std_msgs/String"), 0, Bytes(10));
  expect_refused({"no colour images", "no images at all"});
}

TEST_F(RecordingFrames, OfDepthOnlyAreRefused) {
  const int depth = topic("/depth/image", "sensor_msgs/Image");
  put(depth, 0, ros::image(kVersion, 0, "", "16UC1", depth_image(0)));
  expect_refused({"no colour images", "/depth/image"});
}

TEST_F(RecordingFrames, OfColourOnlyAreRefused) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image");
  put(colour, 0, ros::image(kVersion, 0, "", "rgb8", colour_image(0)));
  expect_refused({"no depth images", "/rgb/image"}, {}, small_camera());
}

TEST_F(RecordingFrames, OfTwoCamerasNeedAChoice) {
  for (const std::string camera : {"/front", "/back"}) {
    const int colour = topic(camera + "/color/image_raw", "sensor_msgs/Image");
    const int depth = topic(camera + "/aligned_depth_to_color/image_raw", "sensor_msgs/Image");
    put(colour, 0, ros::image(kVersion, 0, camera, "rgb8", colour_image(0)));
    put(depth, 0, ros::image(kVersion, 0, camera, "16UC1", depth_image(0)));
  }
  expect_refused({"2 topics of colour images", "--colour", "/front/color/image_raw", "/back/color/image_raw"},
                 {}, small_camera());
  const RecordingSource chosen(
      file_, {"/back/color/image_raw", "/back/aligned_depth_to_color/image_raw", {}, {}}, small_camera());
  EXPECT_EQ(chosen.streams().colour.topic.name, "/back/color/image_raw");
  try {
    const RecordingSource wrong(file_, {"/up/color/image_raw", {}, {}, {}}, small_camera());
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no such topic"), std::string::npos);
  }
}

TEST_F(RecordingFrames, OfAnUnknownEncodingAreRefused) {
  const int colour = topic("/rgb/image", "sensor_msgs/Image"),
            depth = topic("/depth/image", "sensor_msgs/Image");
  put(colour, 0, ros::image(kVersion, 0, "", "rgb10", colour_image(0)));
  put(depth, 0, ros::image(kVersion, 0, "", "16UC1", depth_image(0)));
  expect_refused({"rgb10", "/rgb/image"}, {}, small_camera());
}

TEST_F(RecordingFrames, WithoutACalibrationNeedACamera) {
  const int colour = topic("/camera/color/image_raw", "sensor_msgs/Image");
  const int depth = topic("/camera/depth/image", "sensor_msgs/Image");
  put(colour, 0, ros::image(kVersion, 0, "", "rgb8", colour_image(0)));
  put(depth, 0, ros::image(kVersion, 0, "", "16UC1", depth_image(0)));
  expect_refused({"camera_info", "--camera"});
}

TEST_F(RecordingFrames, WithACalibrationOfZerosNeedACamera) {
  Camera zeros = small_camera();
  zeros.fx = zeros.fy = 0.0;
  const int info = topic("/camera/color/camera_info", "sensor_msgs/CameraInfo");
  const int colour = topic("/camera/color/image_raw", "sensor_msgs/Image");
  const int depth = topic("/camera/depth/image", "sensor_msgs/Image");
  put(info, 0, ros::camera_info(kVersion, 0, "", zeros));
  put(colour, 0, ros::image(kVersion, 0, "", "rgb8", colour_image(0)));
  put(depth, 0, ros::image(kVersion, 0, "", "16UC1", depth_image(0)));
  expect_refused({"camera_info of /camera/color/image_raw", "--camera"});
}

TEST_F(RecordingFrames, WhoseDepthCannotBeRegisteredAreRefused) {
  Camera depth_camera = small_camera();
  depth_camera.fx = depth_camera.fy = 40.0;
  const int colour = topic("/camera/color/image_raw", "sensor_msgs/Image");
  const int colour_info = topic("/camera/color/camera_info", "sensor_msgs/CameraInfo");
  const int depth = topic("/camera/depth/image_rect_raw", "sensor_msgs/Image");
  const int depth_info = topic("/camera/depth/camera_info", "sensor_msgs/CameraInfo");
  put(colour_info, 0, ros::camera_info(kVersion, 0, "colour", small_camera()));
  put(depth_info, 0, ros::camera_info(kVersion, 0, "depth", depth_camera));
  put(colour, 0, ros::image(kVersion, 0, "colour", "rgb8", colour_image(0)));
  put(depth, 0, ros::image(kVersion, 0, "depth", "16UC1", depth_image(0)));
  expect_refused({"another camera", "/tf_static", "aligned_depth_to_color"});
}

// A recording of the RealSense SDK as rosbag2, made by the test after its description; none is at hand.
TEST_F(RecordingFrames, OfTheRealSenseSdkInRosbag2) {
  const fs::path file = folder_ / "flight.db3";
  const auto text = [](const std::string& content) {
    ros::Writer writer(Version::kRos2);
    writer.put_text(content);
    return writer.take();
  };
  Camera depth_camera = small_camera();
  depth_camera.fx = depth_camera.fy = 40.0;
  const std::string sensor = "/device_0/sensor_";
  const auto write = [&](const std::string& clock) {
    fs::remove(file);
    Db3Writer writer(file);
    const auto put_text = [&](const std::string& name, const std::string& content) {
      writer.write(writer.add_topic(name, "std_msgs/msg/String", ""), 1, text(content));
    };
    const auto info = [](const Camera& c) {
      return "width=64;height=48;fx=" + std::to_string(c.fx) + ";ppx=31.5;fy=" + std::to_string(c.fy) +
             ";ppy=23.5;model=Brown_Conrady;coeffs=0,0,0,0,0";
    };
    put_text(sensor + "0/Depth_0/camera_info", info(depth_camera));
    put_text(sensor + "1/Color_0/camera_info", info(small_camera()));
    put_text(sensor + "0/Depth_0/info", "encoding=mono16;fps=10");
    put_text(sensor + "1/Color_0/info", "encoding=rgb8;fps=10");
    put_text(sensor + "0/Depth_0/tf/ref_0", "rotation=1,0,0,0,1,0,0,0,1;translation=0,0,0");
    // By columns: a rotation by 90 degrees about z.
    put_text(sensor + "1/Color_0/tf/ref_0", "rotation=0,1,0,-1,0,0,0,0,1;translation=0.015,0.002,0.001");
    const int depth = writer.add_topic(sensor + "0/Depth_0/image/data", "sensor_msgs/msg/Image", "");
    const int colour = writer.add_topic(sensor + "1/Color_0/image/data", "sensor_msgs/msg/Image", "");
    const int metadata = writer.add_topic(sensor + "0/Depth_0/image/metadata", "std_msgs/msg/String", "");
    const int other = writer.add_topic(sensor + "1/Color_0/image/metadata", "std_msgs/msg/String", "");
    for (int i = 0; i < 3; ++i) {
      const std::int64_t t = 10 + i * kFrame;
      writer.write(depth, t, ros::image(Version::kRos2, t, "0", "mono16", depth_image(i)));
      writer.write(metadata, t, text("timestamp_domain=Global_Time;depth_units=0.0001"));
      writer.write(colour, t,
                   ros::image(Version::kRos2, t + 20 * kMillisecond, "0", "rgb8", colour_image(i)));
      writer.write(other, t, text("timestamp_domain=" + clock));
    }
    writer.close();
  };
  write("Global_Time");
  RecordingSource source(file, {}, {});
  EXPECT_EQ(source.camera().depth_units_per_metre, 10000.0);
  EXPECT_EQ(source.camera().fps, 10.0);
  ASSERT_TRUE(source.streams().T_colour_depth);
  EXPECT_LT(
      (*source.streams().T_colour_depth * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.015, 1.002, 0.001))
          .norm(),
      1e-9);
  EXPECT_EQ(all(source).size(), 3U);
  write("Hardware_Clock");
  try {
    const RecordingSource refused(file, {}, {});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("Hardware Clock"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("Global Time"), std::string::npos) << error.what();
  }
}

// Projects each depth pixel by its centre; several on one pixel: the nearest.
cv::Mat projected(const cv::Mat& depth, const Camera& from, const Camera& to, const SE3& T_to_from) {
  cv::Mat result = cv::Mat::zeros(to.height, to.width, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double z = depth.at<float>(v, u);
      if (z <= 0.0) continue;
      const Eigen::Vector3d point = T_to_from * from.unproject(from.undistort(Eigen::Vector2d(u, v)), z);
      const Eigen::Vector2d pixel = to.distort(to.project(point));
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (!cv::Rect(0, 0, to.width, to.height).contains(at)) continue;
      float& there = result.at<float>(at);
      if (there == 0.0F || point.z() < static_cast<double>(there)) there = static_cast<float>(point.z());
    }
  }
  return result;
}

TEST(RealSenseBag, OpensWithoutACameraAndRegistersDepth) {
  const fs::path file = fs::path(ROSLAM_TEST_DATA) / "recordings/realsense_d435.bag";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is absent";
  RecordingSource source(file, {}, {});
  EXPECT_NEAR(source.camera().fx, 613.2, 0.5);
  EXPECT_EQ(source.camera().depth_units_per_metre, 1000.0);
  EXPECT_EQ(source.camera().fps, 6.0);
  ASSERT_TRUE(source.streams().T_colour_depth);
  EXPECT_NEAR(source.streams().T_colour_depth->translation().x(), 0.0143, 0.0001);
  EXPECT_NEAR(source.streams().depth_camera.fx, 390.4, 0.5);
  const auto recording = open_recording(file);
  const RecordingContents contents = contents_of(*recording, LookAt::kWhole);
  std::size_t depth_images = 0, colour_images = 0;
  for (const RecordedImages& images : contents.images)
    (images.kind == PixelKind::kDepth ? depth_images : colour_images) += images.stamps.size();
  EXPECT_EQ(depth_images, 2U);
  EXPECT_EQ(colour_images, 1U);
  // The colour image is 0.1 s before the first depth image, more than half a frame.
  const auto frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->depth.empty());
  EXPECT_FALSE(source.next());
  EXPECT_EQ(source.skipped_depth(), (Counts{{"no depth image near in time: the nearest is 101 ms from the "
                                             "colour image, at most 83 ms is taken as one moment",
                                             1}}));
  const DepthRegistration registration(source.streams().depth_camera, source.camera(),
                                       *source.streams().T_colour_depth);
  recording->select({source.streams().depth.topic.id});
  while (const auto message = recording->next()) {
    const cv::Mat raw = depth_pixels(decode_image_of(source.streams().depth, message->data, true), 1000.0);
    const cv::Mat registered = registration(raw);
    const cv::Mat expected =
        projected(raw, source.streams().depth_camera, source.camera(), *source.streams().T_colour_depth);
    std::size_t compared = 0, equal = 0;
    for (int y = 0; y < expected.rows; ++y) {
      for (int x = 0; x < expected.cols; ++x) {
        const float a = expected.at<float>(y, x), b = registered.at<float>(y, x);
        if (a == 0.0F) continue;
        ++compared;
        equal += std::abs(a - b) < 0.01F * a ? 1 : 0;
      }
    }
    EXPECT_GT(compared, 50000U);
    EXPECT_GE(static_cast<double>(equal), 0.99 * static_cast<double>(compared));
  }
}

}  // namespace
}  // namespace roslam
