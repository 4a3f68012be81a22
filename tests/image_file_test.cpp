// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/image_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class ImageFiles : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    image_ = cv::Mat(48, 64, CV_8UC3, cv::Scalar(40, 60, 80));
    image_(cv::Rect(0, 0, 20, 12)) = cv::Scalar(200, 180, 160);  // tells the orientation
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string encoded(const std::string& ending, const cv::Mat& image) const {
    std::vector<unsigned char> bytes;
    cv::imencode(ending, image, bytes);
    return {bytes.begin(), bytes.end()};
  }

  fs::path put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  // A JPEG file with an APP1 segment that holds an EXIF orientation (TIFF 6.0, tag 0x0112), 1 to 8.
  std::string with_orientation(char orientation) const {
    const std::string tiff{'I', 'I', '*', 0, 8, 0,           0, 0, 1, 0, 0x12, 0x01, 3,
                           0,   1,   0,   0, 0, orientation, 0, 0, 0, 0, 0,    0,    0};
    const std::string exif = std::string("Exif\0\0", 6) + tiff;
    const auto length = static_cast<char>(exif.size() + 2);
    const std::string jpeg = encoded(".jpg", image_);
    return jpeg.substr(0, 2) + std::string{'\xff', '\xe1', 0, length} + exif + jpeg.substr(2);
  }

  const fs::path folder_ = scratch_path();
  cv::Mat image_;
};

TEST_F(ImageFiles, PixelsAreTakenAsStoredWhateverTheOrientation) {
  for (char orientation = 1; orientation <= 8; ++orientation) {
    const auto file = put("turned.jpg", with_orientation(orientation));
    const ImageFile read = read_colour_image(file);
    ASSERT_TRUE(read.error.empty()) << read.error;
    ASSERT_EQ(read.image.size(), image_.size()) << int{orientation};
    EXPECT_LT(cv::norm(read.image, image_, cv::NORM_L1) / static_cast<double>(image_.total()), 12.0)
        << int{orientation};
    if (orientation == 3) {  // shows that the tag is one that decoders obey
      EXPECT_GT(
          cv::norm(cv::imread(file.string()), image_, cv::NORM_L1) / static_cast<double>(image_.total()),
          20.0);
    }
  }
}

TEST_F(ImageFiles, GreyImagesBecomeThreeEqualChannels) {
  cv::Mat grey(48, 64, CV_8UC1);
  for (int x = 0; x < 64; ++x) grey.col(x) = 4 * x;
  const ImageFile png = read_colour_image(put("grey.png", encoded(".png", grey)));
  ASSERT_EQ(png.error, "");
  ASSERT_EQ(png.image.type(), CV_8UC3);
  EXPECT_EQ(png.image.at<cv::Vec3b>(7, 50), cv::Vec3b(200, 200, 200));
  const ImageFile jpeg = read_colour_image(put("grey.jpg", encoded(".jpg", grey)));
  ASSERT_EQ(jpeg.image.type(), CV_8UC3);
  EXPECT_NEAR(jpeg.image.at<cv::Vec3b>(7, 50)[1], 200, 3);
  // 16 bits, in use all or twelve: the most significant eight remain.
  for (const int bits : {12, 16}) {
    cv::Mat deep;
    grey.convertTo(deep, CV_16UC1, 1 << (bits - 8));
    deep.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>((1 << bits) - 1);
    const ImageFile read = read_colour_image(put("grey16.png", encoded(".png", deep)));
    ASSERT_EQ(read.error, "");
    ASSERT_EQ(read.image.type(), CV_8UC3) << bits;
    EXPECT_EQ(read.bits, bits);
    EXPECT_EQ(read.image.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
    for (int x = 1; x < 64; ++x) {
      const cv::Vec3b pixel = read.image.at<cv::Vec3b>(7, x);
      EXPECT_NEAR(pixel[0], 4 * x, 1) << bits;
      EXPECT_TRUE(pixel[0] == pixel[1] && pixel[1] == pixel[2]);
    }
  }
}

TEST_F(ImageFiles, PaddingAfterTheEndDoesNotMatter) {
  for (const std::string ending : {".jpg", ".png"}) {
    const std::string bytes = encoded(ending, image_);
    for (const std::string& padding :
         {std::string(5000, '\0'), std::string(200, '\xff'), std::string("trailer")}) {
      const ImageFile read = read_colour_image(put("padded" + ending, bytes + padding));
      EXPECT_EQ(read.error, "") << ending;
      EXPECT_EQ(read.image.size(), image_.size());
    }
  }
}

TEST_F(ImageFiles, AThumbnailsEndIsNotTheImagesEnd) {
  const std::string jpeg = encoded(".jpg", image_);
  const std::string thumbnail = encoded(".jpg", image_(cv::Rect(0, 0, 16, 16)));
  const auto length = thumbnail.size() + 2;
  const std::string segment =
      std::string{'\xff', '\xe1', static_cast<char>(length >> 8), static_cast<char>(length)} + thumbnail;
  const std::string whole = jpeg.substr(0, 2) + segment + jpeg.substr(2);
  EXPECT_EQ(read_colour_image(put("thumbnail.jpg", whole)).error, "");
  const std::string half = whole.substr(0, whole.size() - jpeg.size() / 2);
  EXPECT_EQ(read_colour_image(put("half.jpg", half)).error, "is truncated");
  EXPECT_EQ(read_colour_image(put("half.jpg", half + std::string(4000, '\0'))).error, "is truncated")
      << "padded after it was cut";
}

TEST_F(ImageFiles, ReducesSixteenBitsByTheBitsInUse) {
  cv::Mat ramp(48, 64, CV_16UC3);
  for (const int bits : {8, 10, 12, 14, 16}) {
    const int largest = (1 << bits) - 1;
    for (int x = 0; x < ramp.cols; ++x) ramp.col(x) = cv::Scalar::all(largest * x / 63);
    const ImageFile read = read_colour_image(put("deep.png", encoded(".png", ramp)));
    EXPECT_EQ(read.bits, bits);
    ASSERT_EQ(read.image.type(), CV_8UC3);
    for (int x = 0; x < ramp.cols; ++x)
      EXPECT_NEAR(read.image.at<cv::Vec3b>(5, x)[1], 255.0 * x / 63, 1.5) << bits;
  }
  // A dark image of a camera of 12 bits stays as dark as it is.
  ramp = cv::Scalar::all(200);
  EXPECT_EQ(read_colour_image(put("dark.png", encoded(".png", ramp)), 12).image.at<cv::Vec3b>(0, 0)[0], 12);
}

TEST_F(ImageFiles, TheEndOfTheRangeOfADepthSensorIsUnknown) {
  cv::Mat raw(48, 64, CV_16UC1);
  for (int x = 0; x < raw.cols; ++x) raw.col(x) = 1000 + 10 * x;
  for (const int sentinel : {2047, 4095, 4096, 8191, 32767, 65535}) {
    cv::Mat marked = raw.clone();
    marked(cv::Rect(10, 10, 6, 6)) = sentinel;
    std::size_t saturated = 0;
    const cv::Mat metres = depth_to_metres(marked, 1000.0, &saturated);
    EXPECT_EQ(saturated, 36u) << sentinel;
    EXPECT_EQ(metres.at<float>(12, 12), 0.0F) << sentinel;
    EXPECT_FLOAT_EQ(metres.at<float>(40, 5), 1.05F);
  }
  // Depth that happens to reach such a value is depth.
  for (int x = 0; x < raw.cols; ++x) raw.col(x) = 4095 - 63 + x;
  std::size_t saturated = 1;
  EXPECT_FLOAT_EQ(depth_to_metres(raw, 1000.0, &saturated).at<float>(0, 63), 4.095F);
  EXPECT_EQ(saturated, 0u);
}

}  // namespace
}  // namespace roslam
