// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/ros_messages.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "roslam/common/error.hpp"
#include "roslam/ros/frame_tree.hpp"
#include "roslam/ros/ros_images.hpp"
#include "tests/ros_writer.hpp"

namespace roslam {
namespace {

using ros::Bytes;
using ros::Version;

constexpr std::int64_t kStamp = 1305031236929669123;

SE3 some_pose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized())),
          {1.5, -2.0, 0.25}};
}

class Messages : public testing::TestWithParam<Version> {
 protected:
  static RosEncoding encoding() {
    return GetParam() == Version::kRos1 ? RosEncoding::kRos1 : RosEncoding::kCdr;
  }

  // A message that ends anywhere is refused, and nothing is read beyond its end (by the address sanitizer).
  template <typename Decode>
  static void expect_refused_when_cut(const Bytes& message, std::size_t whole, const Decode& decode) {
    for (std::size_t size = 0; size < whole; ++size) {
      const Bytes cut(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_THROW(decode(cut), InputError) << size;
    }
  }
};

TEST_P(Messages, AnImage) {
  cv::Mat pixels(3, 5, CV_8UC3);
  cv::randu(pixels, 0, 255);
  const Bytes message = ros::image(GetParam(), kStamp, "camera", "rgb8", pixels);
  const RosImage image = decode_image(message, encoding());
  EXPECT_EQ(image.header.stamp, kStamp);
  EXPECT_EQ(image.header.frame, "camera");
  EXPECT_EQ(image.encoding, "rgb8");
  EXPECT_EQ(kind_of(image), PixelKind::kColour);
  cv::Mat expected;
  cv::cvtColor(pixels, expected, cv::COLOR_RGB2BGR);
  EXPECT_EQ(cv::norm(colour_pixels(image), expected, cv::NORM_INF), 0.0);
  EXPECT_THROW(depth_pixels(image, 1000.0), InputError);
  expect_refused_when_cut(message, message.size(),
                          [](const Bytes& cut) { return decode_image(cut, encoding()); });
}

TEST_P(Messages, DepthInMillimetresAndMetres) {
  cv::Mat millimetres(4, 6, CV_16UC1);
  cv::randu(millimetres, 400, 4000);
  millimetres.at<std::uint16_t>(1, 1) = 0;
  millimetres.at<std::uint16_t>(1, 2) = 65535;
  const Bytes message = ros::image(GetParam(), kStamp, "camera", "16UC1", millimetres);
  std::size_t saturated = 0;
  const cv::Mat metres = depth_pixels(decode_image(message, encoding()), 1000.0, &saturated);
  EXPECT_FLOAT_EQ(metres.at<float>(0, 0), static_cast<float>(millimetres.at<std::uint16_t>(0, 0)) / 1000.0F);
  EXPECT_EQ(metres.at<float>(1, 1), 0.0F);
  EXPECT_EQ(metres.at<float>(1, 2), 0.0F);
  EXPECT_EQ(saturated, 1U);
  cv::Mat floats = metres.clone();
  floats.at<float>(1, 1) = std::numeric_limits<float>::quiet_NaN();
  floats.at<float>(1, 2) = -1.0F;
  const Bytes other = ros::image(GetParam(), kStamp, "camera", "32FC1", floats);
  EXPECT_EQ(cv::norm(depth_pixels(decode_image(other, encoding()), 5000.0), metres, cv::NORM_INF), 0.0);
}

TEST_P(Messages, CompressedImages) {
  cv::Mat pixels(48, 64, CV_8UC3, cv::Scalar(20, 130, 240)), depth(48, 64, CV_16UC1, cv::Scalar(1234));
  Bytes png, depth_png;
  cv::imencode(".png", pixels, png);
  cv::imencode(".png", depth, depth_png);
  const Bytes colour_message =
      ros::compressed_image(GetParam(), kStamp, "camera", "bgr8; png compressed bgr8", png);
  const RosImage colour = decode_compressed_image(colour_message, encoding());
  EXPECT_EQ(cv::norm(colour_pixels(colour), pixels, cv::NORM_INF), 0.0);
  Bytes with_header(12, 0);
  with_header.insert(with_header.end(), depth_png.begin(), depth_png.end());
  const Bytes depth_message =
      ros::compressed_image(GetParam(), kStamp, "camera", "16UC1; compressedDepth png", with_header);
  const RosImage compressed = decode_compressed_image(depth_message, encoding());
  EXPECT_EQ(kind_of(compressed), PixelKind::kDepth);
  EXPECT_FLOAT_EQ(depth_pixels(compressed, 1000.0).at<float>(5, 5), 1.234F);
  // Inverse depth: value = a / depth + b.
  const std::array<float, 2> quantisation{1000.0F, 0.5F};
  std::memcpy(with_header.data() + 4, quantisation.data(), 8);
  const Bytes inverse_message =
      ros::compressed_image(GetParam(), kStamp, "camera", "32FC1; compressedDepth", with_header);
  EXPECT_FLOAT_EQ(depth_pixels(decode_compressed_image(inverse_message, encoding()), 1000.0).at<float>(5, 5),
                  1000.0F / 1233.5F);
  const Bytes rvl_message =
      ros::compressed_image(GetParam(), kStamp, "camera", "16UC1; compressedDepth rvl", with_header);
  EXPECT_THROW(depth_pixels(decode_compressed_image(rvl_message, encoding()), 1000.0), InputError);
  Bytes bitmap;
  cv::imencode(".bmp", pixels, bitmap);
  png.resize(20);
  for (const Bytes& data : {png, bitmap, Bytes{1, 2, 3}}) {
    const Bytes bad = ros::compressed_image(GetParam(), kStamp, "camera", "png", data);
    EXPECT_THROW(colour_pixels(decode_compressed_image(bad, encoding())), InputError);
  }
}

TEST_P(Messages, ACalibration) {
  Camera camera;
  camera.fx = 613.2;
  camera.distortion = {0.1, -0.2, 0.001, 0.002, 0.03};
  const Bytes message = ros::camera_info(GetParam(), kStamp, "camera", camera);
  const RosCameraInfo info = decode_camera_info(message, encoding());
  const Camera read = camera_of(info);
  EXPECT_EQ(read.fx, camera.fx);
  EXPECT_EQ(read.cy, camera.cy);
  EXPECT_EQ(read.distortion, camera.distortion);
  EXPECT_FALSE(camera_of(info, true).has_distortion()) << "of the rectified image";
  expect_refused_when_cut(message, message.size() - 25,
                          [](const Bytes& cut) { return decode_camera_info(cut, encoding()); });
  Camera zeros = camera;
  zeros.fx = zeros.fy = zeros.cx = zeros.cy = 0.0;
  const Bytes uncalibrated = ros::camera_info(GetParam(), kStamp, "camera", zeros);
  EXPECT_THROW(camera_of(decode_camera_info(uncalibrated, encoding())), CalibrationError);
  const auto lens_of = [&](const char* model) {
    const Bytes of_model = ros::camera_info(GetParam(), kStamp, "camera", camera, model);
    return camera_of(decode_camera_info(of_model, encoding())).model;
  };
  for (const char* model : {"plumb_bob", "Brown Conrady", "Inverse Brown Conrady"})
    EXPECT_EQ(lens_of(model), LensModel::kPinhole) << model;
  EXPECT_EQ(lens_of("equidistant"), LensModel::kFisheye);
  const Bytes odd = ros::camera_info(GetParam(), kStamp, "camera", camera, "kannala_of_nowhere");
  EXPECT_THROW(camera_of(decode_camera_info(odd, encoding())), CalibrationError);
}

TEST_P(Messages, AnInertialSample) {
  const Bytes message = ros::imu(GetParam(), kStamp, "imu", {0.1, 0.2, 0.3}, {0.5, -9.7, 1.0});
  const RosImu imu = decode_imu(message, encoding());
  EXPECT_EQ(imu.turn_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(imu.acceleration, Eigen::Vector3d(0.5, -9.7, 1.0));
  expect_refused_when_cut(message, message.size() - 72,
                          [](const Bytes& cut) { return decode_imu(cut, encoding()); });
}

TEST_P(Messages, Poses) {
  const SE3 pose = some_pose();
  const auto expect_pose = [&](const char* type, const Bytes& message, const std::string& child) {
    const auto read = decode_transforms(type, message, encoding());
    ASSERT_TRUE(read) << type;
    const RosTransform& last = read->back();
    EXPECT_EQ(last.header.stamp, kStamp);
    EXPECT_EQ(last.header.frame, "world");
    EXPECT_EQ(last.child, child);
    EXPECT_LT((last.T_parent_child.inverse() * pose).log().norm(), 1e-12);
  };
  expect_pose("geometry_msgs/PoseStamped", ros::pose_stamped(GetParam(), kStamp, "world", pose), "");
  expect_pose("nav_msgs/Odometry", ros::odometry(GetParam(), kStamp, "world", "base", pose), "base");
  expect_pose("tf2_msgs/TFMessage",
              ros::tf(GetParam(), kStamp, {{"a", "b", SE3()}, {"world", "body of some length", pose}}),
              "body of some length");
  EXPECT_FALSE(decode_transforms("std_msgs/String", Bytes(40), encoding()));
  // One that is no pose costs only itself.
  const SE3 none = SE3::from_parts(Eigen::Quaterniond(0, 0, 0, 0), Eigen::Vector3d::Zero());
  const auto rest =
      decode_transforms("tf2_msgs/TFMessage",
                        ros::tf(GetParam(), kStamp, {{"a", "b", none}, {"world", "c", pose}}), encoding());
  ASSERT_TRUE(rest);
  ASSERT_EQ(rest->size(), 1U);
  EXPECT_EQ(rest->front().child, "c");
  EXPECT_THROW(decode_transforms("geometry_msgs/PoseStamped",
                                 ros::pose_stamped(GetParam(), kStamp, "world", none), encoding()),
               InputError);
  ros::Writer claims_many(GetParam());
  claims_many.put(std::uint32_t{4000000000U});
  EXPECT_THROW(decode_transforms("tf2_msgs/TFMessage", claims_many.take(), encoding()), InputError);
}

INSTANTIATE_TEST_SUITE_P(Versions, Messages, testing::Values(Version::kRos1, Version::kRos2),
                         [](const auto& tested) { return tested.param == Version::kRos1 ? "Ros1" : "Ros2"; });

TEST(RosImages, EncodingsOfColour) {
  const cv::Vec3b blue_green_red(10, 100, 200);
  const auto expect = [&](const char* encoding, const cv::Mat& pixels, double tolerance) {
    const Bytes message = ros::image(Version::kRos1, 0, "", encoding, pixels);
    const cv::Mat colour = colour_pixels(decode_image(message, RosEncoding::kRos1));
    ASSERT_EQ(colour.type(), CV_8UC3) << encoding;
    EXPECT_LE(cv::norm(colour(cv::Rect(4, 4, 8, 8)), cv::Mat(8, 8, CV_8UC3, cv::Scalar(10, 100, 200)),
                       cv::NORM_INF),
              tolerance)
        << encoding;
  };
  const cv::Mat bgr(16, 16, CV_8UC3, cv::Scalar(blue_green_red));
  cv::Mat other;
  expect("bgr8", bgr, 0);
  cv::cvtColor(bgr, other, cv::COLOR_BGR2RGBA);
  expect("rgba8", other, 0);
  cv::cvtColor(bgr, other, cv::COLOR_BGR2BGRA);
  expect("bgra8", other, 0);
  // A mosaic of the pattern's first two rows.
  const auto mosaic = [&](const char* pattern) {
    cv::Mat raw(16, 16, CV_8UC1);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        const char c = pattern[2 * (y % 2) + x % 2];
        raw.at<std::uint8_t>(y, x) = c == 'b' ? 10 : c == 'g' ? 100 : 200;
      }
    }
    return raw;
  };
  for (const std::string pattern : {"rggb", "bggr", "gbrg", "grbg"})
    expect(("bayer_" + pattern + "8").c_str(), mosaic(pattern.c_str()), 1);
  // Luminance and chrominance of the colour by ITU-R BT.601, two pixels in four bytes.
  const double y = 16 + (65.738 * 200 + 129.057 * 100 + 25.064 * 10) / 256;
  const double u = 128 + (-37.945 * 200 - 74.494 * 100 + 112.439 * 10) / 256;
  const double v = 128 + (112.439 * 200 - 94.154 * 100 - 18.285 * 10) / 256;
  const auto packed = [](std::array<double, 4> bytes) {
    cv::Mat raw(16, 16, CV_8UC2);
    for (int row = 0; row < 16; ++row)
      for (int i = 0; i < 32; ++i)
        raw.ptr(row)[i] = cv::saturate_cast<std::uint8_t>(bytes[static_cast<std::size_t>(i % 4)]);
    return raw;
  };
  expect("yuv422", packed({u, y, v, y}), 3);
  expect("yuv422_yuy2", packed({y, u, y, v}), 3);
  const Bytes grey = ros::image(Version::kRos1, 0, "", "mono8", cv::Mat(16, 16, CV_8UC1, cv::Scalar(77)));
  EXPECT_EQ(kind_of(decode_image(grey, RosEncoding::kRos1)), PixelKind::kGrey);
  EXPECT_EQ(colour_pixels(decode_image(grey, RosEncoding::kRos1)).at<cv::Vec3b>(3, 3), cv::Vec3b(77, 77, 77));
  const Bytes odd = ros::image(Version::kRos1, 0, "", "rgb10", cv::Mat(16, 16, CV_8UC1));
  EXPECT_EQ(kind_of(decode_image(odd, RosEncoding::kRos1)), PixelKind::kUnknown);
  EXPECT_THROW(colour_pixels(decode_image(odd, RosEncoding::kRos1)), InputError);
}

TEST(RosImages, RowsMayBePaddedButNotShort) {
  ros::Writer writer(Version::kRos1);
  const auto put = [&](std::uint32_t width, std::uint32_t step, std::size_t bytes) {
    ros::Writer w(Version::kRos1);
    w.put_header(0, "");
    w.put(std::uint32_t{2});
    w.put(width);
    w.put_text("mono8");
    w.put(std::uint8_t{0});
    w.put(step);
    w.put_bytes(Bytes(bytes, 9));
    return w.take();
  };
  EXPECT_EQ(colour_pixels(decode_image(put(5, 8, 16), RosEncoding::kRos1)).cols, 5);
  EXPECT_THROW(colour_pixels(decode_image(put(5, 4, 16), RosEncoding::kRos1)), InputError);
  EXPECT_THROW(decode_image(put(5, 8, 15), RosEncoding::kRos1), InputError);
  EXPECT_THROW(decode_image(put(4000000000U, 8, 16), RosEncoding::kRos1), InputError);
  EXPECT_THROW(decode_image(put(0, 8, 16), RosEncoding::kRos1), InputError);
  ros::Writer odd(Version::kRos1);  // rows that end within a pixel
  odd.put_header(0, "");
  odd.put(std::uint32_t{2});
  odd.put(std::uint32_t{3});
  odd.put_text("16UC1");
  odd.put(std::uint8_t{0});
  odd.put(std::uint32_t{7});
  odd.put_bytes(Bytes(14, 1));
  EXPECT_THROW(depth_pixels(decode_image(odd.take(), RosEncoding::kRos1), 1000.0), InputError);
}

TEST(RosTime, IsRoundedAsADecimalNumberIs) {
  for (const char* text :
       {"1305031236.929669", "0.033333", "1403636579.763555527", "0.000000001", "99.999999999"}) {
    const std::string digits = text;
    const std::size_t point = digits.find('.');
    std::string fraction = digits.substr(point + 1);
    fraction.resize(9, '0');
    const std::int64_t nanoseconds = std::stoll(digits.substr(0, point)) * 1000000000 + std::stoll(fraction);
    EXPECT_EQ(seconds_of(nanoseconds), std::stod(digits)) << text;
    EXPECT_EQ(seconds_of(-nanoseconds), -std::stod(digits)) << text;
  }
}

TEST(FrameTree, JoinsFramesOverTheirCommonParent) {
  FrameTree tree;
  const SE3 T_base_colour = some_pose();
  const SE3 T_base_mast(Eigen::Quaterniond::Identity(), {0, 0, 1});
  const SE3 T_mast_imu(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX())), {0.1, 0, 0});
  tree.add("base", "/colour", T_base_colour);
  tree.add("base", "mast", T_base_mast);
  tree.add("/mast", "imu", T_mast_imu);
  const auto found = tree.transform("colour", "imu");
  ASSERT_TRUE(found);
  EXPECT_LT((found->inverse() * T_base_colour.inverse() * T_base_mast * T_mast_imu).log().norm(), 1e-12);
  EXPECT_LT(((*tree.transform("imu", "colour")) * *found).log().norm(), 1e-12);
  EXPECT_FALSE(tree.transform("colour", "elsewhere"));
  EXPECT_TRUE(tree.transform("elsewhere", "elsewhere"));
  tree.add("base", "gimbal", T_mast_imu, false);
  EXPECT_TRUE(tree.transform("colour", "gimbal"));
  tree.add("base", "gimbal", T_base_mast, false);  // it moves
  EXPECT_FALSE(tree.transform("colour", "gimbal"));
  tree.add("base", "mast", T_mast_imu, false);  // said to be fixed before
  EXPECT_LT((tree.transform("colour", "imu")->inverse() * *found).log().norm(), 1e-12);
  tree.add("a", "b", SE3());
  tree.add("b", "a", SE3());  // a circle
  EXPECT_FALSE(tree.transform("a", "colour"));
  EXPECT_FALSE(tree.transform("colour", "a"));
}

TEST(MessageTypes, AreNamedAsInRos1) {
  EXPECT_EQ(plain_type("sensor_msgs/msg/Image"), "sensor_msgs/Image");
  EXPECT_EQ(plain_type("sensor_msgs/Image"), "sensor_msgs/Image");
}

}  // namespace
}  // namespace roslam
