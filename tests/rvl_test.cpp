// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/rvl.hpp"

#include <gtest/gtest.h>

#include <string>

#include "roslam/common/error.hpp"
#include "roslam/ros/ros_images.hpp"
#include "tests/ros_writer.hpp"
#include "tests/rvl_writer.hpp"

namespace roslam {
namespace {

using ros::Bytes;
using ros::RvlWriter;

// A surface with holes, a step, and noise.
cv::Mat some_depth() {
  cv::Mat depth(48, 64, CV_16UC1), noise(48, 64, CV_16UC1);
  cv::theRNG().state = 5;
  cv::randu(noise, 0, 40);
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u)
      depth.at<std::uint16_t>(v, u) =
          noise.at<std::uint16_t>(v, u) < 4 || u > 60
              ? std::uint16_t{0}
              : static_cast<std::uint16_t>((u < 20 ? 800 : 65000) + noise.at<std::uint16_t>(v, u));
  depth.at<std::uint16_t>(47, 63) = 1200;  // so that the last word of the stream is needed
  return depth;
}

void expect_same(const cv::Mat& got, const cv::Mat& expected) {
  ASSERT_EQ(got.type(), CV_16UC1);
  ASSERT_EQ(got.size(), expected.size());
  EXPECT_EQ(cv::norm(got, expected, cv::NORM_INF), 0.0);
}

// The message of the error.
std::string refusal(const Bytes& bytes) {
  try {
    decode_rvl(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Rvl, DecodesBytesThatWereWorkedOutByHand) {
  // Two zeros and three others: 2 3. From 0 to 1000: 2000, in threes of bits from the lowest 0 2 7 3, so
  // 8 a f 3 with the bits that more follow. Then 1, so 2, and -2, so 3. Three zeros and no others: 3 0.
  // Nibbles 238af323 30000000, in words of little endian.
  const Bytes bytes{4, 0, 0, 0, 2, 0, 0, 0, 0x23, 0xf3, 0x8a, 0x23, 0x00, 0x00, 0x00, 0x30};
  const cv::Mat expected = (cv::Mat_<std::uint16_t>(2, 4) << 0, 0, 1000, 1001, 999, 0, 0, 0);
  expect_same(decode_rvl(bytes), expected);
  EXPECT_EQ(RvlWriter::encode(expected), bytes) << "the encoder of the tests";
}

TEST(Rvl, ReturnsWhatWasEncoded) {
  expect_same(decode_rvl(RvlWriter::encode(some_depth())), some_depth());
  for (const int value : {0, 1, 65535}) {
    const cv::Mat plain(7, 3, CV_16UC1, cv::Scalar(value));
    expect_same(decode_rvl(RvlWriter::encode(plain)), plain);
  }
  cv::Mat extremes(1, 101, CV_16UC1);
  for (int u = 0; u < extremes.cols; ++u)
    extremes.at<std::uint16_t>(u) = static_cast<std::uint16_t>(u % 2 == 0 ? 65535 : 1);
  expect_same(decode_rvl(RvlWriter::encode(extremes)), extremes);
}

TEST(Rvl, RefusesAStreamThatEndsAnywhere) {
  const Bytes whole = RvlWriter::encode(some_depth());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(refusal(cut), "RVL depth image is truncated") << size;
  }
}

TEST(Rvl, RefusesASizeThatIsNone) {
  for (const auto& [width, height] : std::vector<std::pair<std::uint32_t, std::uint32_t>>{
           {0, 4}, {4, 0}, {16385, 1}, {1, 16385}, {16384, 16384}, {0xffffffff, 0xffffffff}})
    EXPECT_EQ(refusal(RvlWriter::of(width, height, {4, 0})),
              "RVL depth image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels");
}

TEST(Rvl, RefusesMorePixelsThanTheImageHas) {
  const std::string expected = "RVL depth image with more pixels than its size";
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {9, 0})), expected);
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {4, 5, 2, 2, 2, 2, 2})), expected);
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {0xffffffff, 0})), expected);
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {3, 0xffffffff})), expected);
}

TEST(Rvl, RefusesNumbersThatDoNotFit) {
  const std::string depth = "RVL depth image with a depth that does not fit 16 bits";
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {0, 8, 1})), depth) << "-1";
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {0, 8, 131072})), depth) << "65536";
  EXPECT_EQ(refusal(RvlWriter::of(4, 2, {0, 8, 131070, 2})), depth) << "65535 and one more";
  Bytes endless{4, 0, 0, 0, 2, 0, 0, 0};
  endless.insert(endless.end(), 64, 0xff);  // each nibble says that another follows
  EXPECT_EQ(refusal(endless), "RVL depth image with a number that is too large");
}

TEST(Rvl, RunsOfNoPixelsEnd) {
  const Bytes nothing(4096, 0);
  Bytes bytes{4, 0, 0, 0, 2, 0, 0, 0};
  bytes.insert(bytes.end(), nothing.begin(), nothing.end());
  EXPECT_EQ(refusal(bytes), "RVL depth image is truncated");
}

TEST(Rvl, IsTakenFromMessages) {
  const cv::Mat depth = some_depth();
  Bytes data(12, 0);
  const Bytes stream = RvlWriter::encode(depth);
  data.insert(data.end(), stream.begin(), stream.end());
  for (const ros::Version version : {ros::Version::kRos1, ros::Version::kRos2}) {
    const RosEncoding encoding = version == ros::Version::kRos1 ? RosEncoding::kRos1 : RosEncoding::kCdr;
    const Bytes message = ros::compressed_image(version, 1, "camera", "16UC1; compressedDepth rvl", data);
    const RosImage image = decode_compressed_image(message, encoding);
    EXPECT_EQ(kind_of(image), PixelKind::kDepth);
    std::size_t saturated = 0;
    const cv::Mat metres = depth_pixels(image, 1000.0, &saturated);
    ASSERT_EQ(metres.size(), depth.size());
    for (int v = 0; v < depth.rows; ++v)
      for (int u = 0; u < depth.cols; ++u)
        ASSERT_FLOAT_EQ(metres.at<float>(v, u), static_cast<float>(depth.at<std::uint16_t>(v, u)) / 1000.0F);
  }
}

}  // namespace
}  // namespace roslam
