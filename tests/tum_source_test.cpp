// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/sensors/image_file.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

std::vector<TimedFile> at(const std::vector<double>& times) {
  std::vector<TimedFile> files;
  for (const double time : times) files.push_back({time, "image.png"});
  return files;
}

std::vector<int> pairs(const std::vector<double>& colour, const std::vector<double>& depth,
                       double tolerance = 0.02) {
  return associate_by_time(at(colour), at(depth), tolerance);
}

TEST(Associate, TakesTheNearestInTime) {
  EXPECT_EQ(pairs({1.0, 2.0}, {0.99, 1.005, 1.99}), (std::vector<int>{1, 2}));
  EXPECT_EQ(pairs({1.0}, {0.995, 1.001, 1.01}), (std::vector<int>{1}));
}

TEST(Associate, LeavesOutWhatIsTooFar) {
  EXPECT_EQ(pairs({1.0, 2.0, 3.0}, {0.97, 2.021, 3.01}), (std::vector<int>{-1, -1, 2}));
  EXPECT_EQ(pairs({1.0}, {}), (std::vector<int>{-1}));
  EXPECT_EQ(pairs({}, {1.0}), std::vector<int>());
  EXPECT_EQ(pairs({1.0, 2.0}, {1.0, 2.5}, 0.0), (std::vector<int>{0, -1}));
}

TEST(Associate, ToleranceIncludesItsEnd) {
  // Quarters are exact in binary.
  EXPECT_EQ(pairs({1.0}, {1.25}, 0.25), (std::vector<int>{0}));
  EXPECT_EQ(pairs({1.0}, {0.75}, 0.25), (std::vector<int>{0}));
  EXPECT_EQ(pairs({1.0}, {1.5}, 0.25), (std::vector<int>{-1}));
}

TEST(Associate, UsesEachDepthImageOnce) {
  // The second image is nearer to the only depth; the first must not take it.
  EXPECT_EQ(pairs({1.0, 1.015}, {1.014}), (std::vector<int>{-1, 0}));
  EXPECT_EQ(pairs({1.0, 1.5, 2.0}, {1.375, 1.75}, 0.5), (std::vector<int>{-1, 0, 1}));
}

TEST(Associate, OfEqualDistancesTheEarlierImageWins) {
  EXPECT_EQ(pairs({1.0, 1.5}, {1.25}, 0.5), (std::vector<int>{0, -1}));
  EXPECT_EQ(pairs({1.25}, {1.0, 1.5}, 0.5), (std::vector<int>{0}));
}

class TumFolder : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    cv::imwrite((folder_ / "colour.png").string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(10, 20, 30)));
    cv::imwrite((folder_ / "colour.jpg").string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(10, 20, 30)));
    cv::imwrite((folder_ / "grey.png").string(), cv::Mat(48, 64, CV_8UC1, cv::Scalar(77)));
    cv::imwrite((folder_ / "depth.png").string(), cv::Mat(48, 64, CV_16UC1, cv::Scalar(2500)));
    camera_.width = 64;
    camera_.height = 48;
    camera_.fx = camera_.fy = 50.0;
    camera_.cx = 31.5;
    camera_.cy = 23.5;
    camera_.depth_units_per_metre = 5000.0;
    camera_.fps = 1.0;  // the times of the lists are whole seconds
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& colour, const std::string& depth) const {
    std::ofstream(folder_ / "rgb.txt") << colour;
    std::ofstream(folder_ / "depth.txt") << depth;
  }

  std::vector<Frame> read(TumSource& source) const {
    std::vector<Frame> frames;
    while (auto frame = source.next()) frames.push_back(*frame);
    return frames;
  }

  const fs::path folder_ = scratch_path();
  Camera camera_;
};

TEST_F(TumFolder, GivesColourAsBgrWhateverItsFormat) {
  write("1 colour.png\n2 colour.jpg\n3 grey.png\n", "1 depth.png\n");
  TumSource source(folder_, camera_);
  const auto frames = read(source);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(source.size(), 3u);
  for (const auto& frame : frames) EXPECT_EQ(frame.colour.type(), CV_8UC3);
  EXPECT_EQ(frames[0].colour.at<cv::Vec3b>(24, 32), cv::Vec3b(10, 20, 30));
  EXPECT_NEAR(frames[1].colour.at<cv::Vec3b>(24, 32)[2], 30, 3);
  EXPECT_EQ(frames[2].colour.at<cv::Vec3b>(24, 32), cv::Vec3b(77, 77, 77));
  EXPECT_FALSE(frames[0].depth.empty());
  EXPECT_TRUE(frames[1].depth.empty());
  EXPECT_EQ(source.skipped_depth().at("no depth image near in time"), 2u);
  EXPECT_TRUE(source.skipped().empty());
}

TEST_F(TumFolder, DividesDepthByTheFactorOfTheCamera) {
  write("1 colour.png\n", "1 depth.png\n");
  for (const auto& [units, metres] :
       {std::pair{1000.0, 2.5F}, {5000.0, 0.5F}, {2500.0, 1.0F}, {1.0, 2500.0F}}) {
    camera_.depth_units_per_metre = units;
    TumSource source(folder_, camera_);
    const auto frame = source.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->depth.type(), CV_32FC1);
    EXPECT_FLOAT_EQ(frame->depth.at<float>(24, 32), metres);
  }
  EXPECT_EQ(depth_to_metres(cv::Mat::zeros(1, 1, CV_16UC1), 1000.0).at<float>(0, 0), 0.0F);
}

TEST_F(TumFolder, FramesCarryTheInertialSamplesSinceTheFrameBefore) {
  write("11 colour.png\n12 absent.png\n13 colour.png\n", "11 depth.png\n");
  std::ofstream(folder_ / "imu.txt") << "# timestamp wx wy wz ax ay az\n"
                                        "1 0 0 0 0 0 0\n"
                                        "10.5 1 0 0 0 0 9.8\n"
                                        "11 2 0 0 0 0 9.8\n"
                                        "11.5 3 0 0 0 0 9.8\n"
                                        "12.5 4 0 0 0 0 9.8\n"
                                        "14 5 0 0 0 0 9.8\n";
  TumSource without(folder_, camera_);
  EXPECT_TRUE(without.next()->inertial.empty());
  EXPECT_EQ(without.notes().count("imu.txt is not used, as the camera file has no imu"), 1u);
  camera_.imu.emplace();
  TumSource source(folder_, camera_);
  const auto frames = read(source);
  ASSERT_EQ(frames.size(), 2u);
  ASSERT_EQ(frames[0].inertial.size(), 2u);
  EXPECT_EQ(frames[0].inertial[0].turn_rate.x(), 1.0);
  ASSERT_EQ(frames[1].inertial.size(), 2u);  // those of the frame that is missing as well
  EXPECT_EQ(frames[1].inertial[0].timestamp, 11.5);
  EXPECT_EQ(frames[1].inertial[1].acceleration.z(), 9.8);
}

TEST_F(TumFolder, OfRepeatedTimesTheFirstStays) {
  write("1 colour.png\n1 grey.png\n", "1 depth.png\n");
  TumSource source(folder_, camera_);
  EXPECT_EQ(source.next()->colour.at<cv::Vec3b>(0, 0), cv::Vec3b(10, 20, 30));
  EXPECT_FALSE(source.next());
}

std::string list_of(const std::vector<double>& times, const char* image) {
  std::string list;
  for (const double time : times) list += std::to_string(time) + " " + image + "\n";
  return list;
}

TEST_F(TumFolder, SortsListsAndSaysSo) {
  write("3 colour.png\n1 grey.png\n2 colour.png\n", "2 depth.png\n1 depth.png\n3 depth.png\n");
  TumSource source(folder_, camera_);
  const auto frames = read(source);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].colour.at<cv::Vec3b>(0, 0), cv::Vec3b(77, 77, 77));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i].timestamp, static_cast<double>(i + 1));
    EXPECT_FALSE(frames[i].depth.empty());
  }
  EXPECT_EQ(source.notes().size(), 2u);
  EXPECT_EQ(source.notes().count("rgb.txt was not in the order of time; sorted"), 1u);
}

TEST_F(TumFolder, BeginsASegmentWhereTheClockRestarts) {
  const std::vector<double> times{11, 12, 13, 14, 15, 16, 11.5, 12.5, 13.5, 14.5, 15.5};
  write(list_of(times, "colour.png"), list_of(times, "depth.png"));
  TumSource source(folder_, camera_);
  const auto frames = read(source);
  ASSERT_EQ(frames.size(), times.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].timestamp, times[i]);
    EXPECT_EQ(frames[i].segment, i < 6 ? 0 : 1);
    EXPECT_FALSE(frames[i].depth.empty());
  }
  EXPECT_EQ(source.notes().at("the clock restarts in rgb.txt; a new segment begins there"), 1u);
  EXPECT_EQ(source.notes().size(), 2u) << "the rate is that within the segments";
  write(list_of(times, "colour.png"), list_of({11, 12, 13, 14, 15, 16}, "depth.png"));
  EXPECT_THROW(TumSource(folder_, camera_), InputError);
}

TEST_F(TumFolder, ConvertsTimestampsOfOtherUnitsAndSaysSo) {
  camera_.fps = 30.0;
  for (const auto& [seconds, word] : {std::pair{1.0, ""},
                                      {1e-3, "milliseconds"},
                                      {1e-6, "microseconds"},
                                      {1e-9, "nanoseconds"},
                                      {1.0 / 30.0, "numbers of frames"}}) {
    std::vector<double> times;
    for (int i = 0; i < 10; ++i) times.push_back(std::round(i / 30.0 / seconds * 1e3) / 1e3);
    write(list_of(times, "colour.png"), list_of(times, "depth.png"));
    TumSource source(folder_, camera_);
    const auto frames = read(source);
    ASSERT_EQ(frames.size(), 10u);
    for (std::size_t i = 0; i < 10; ++i)
      EXPECT_NEAR(frames[i].timestamp, static_cast<double>(i) / 30.0, 1e-3) << word;
    std::string notes;
    for (const auto& [note, number] : source.notes()) notes += note;
    EXPECT_NE(notes.find(word), std::string::npos) << notes;
    EXPECT_EQ(notes.empty(), std::string(word).empty()) << notes;
  }
}

TEST_F(TumFolder, SaysWhereTheTimestampsContradictTheRateOfTheCamera) {
  camera_.fps = 30.0;
  std::vector<double> times;
  for (int i = 0; i < 10; ++i) times.push_back(0.1 * i);
  write(list_of(times, "colour.png"), list_of(times, "depth.png"));
  TumSource source(folder_, camera_);
  EXPECT_EQ(source.notes().count("the camera has 30 images a second, the timestamps 10"), 1u);
}

TEST_F(TumFolder, ReadsNamesWithBlanksQuotesAndBackslashes) {
  fs::create_directories(folder_ / "my images");
  fs::copy_file(folder_ / "colour.png", folder_ / "my images/a b.png");
  fs::copy_file(folder_ / "colour.png", folder_ / "back\\slash.png");
  const std::vector<std::string> spellings{
      "my images/a b.png",  "\"my images/a b.png\"", "'my images/a b.png'",  "my\\ images/a\\ b.png",
      "my images\\a b.png", "back\\slash.png",       "colour.png with more", "\"colour.png\" # comment"};
  for (const auto& spelling : spellings) {
    write("1 " + spelling + "\n", "1 depth.png\n");
    TumSource source(folder_, camera_);
    EXPECT_EQ(read(source).size(), 1u) << spelling;
  }
}

TEST_F(TumFolder, CountsDepthAtTheEndOfTheRangeAsUnknown) {
  cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(2500));
  raw(cv::Rect(0, 0, 8, 8)) = 65535;
  cv::imwrite((folder_ / "depth.png").string(), raw);
  write("1 colour.png\n", "1 depth.png\n");
  TumSource source(folder_, camera_);
  const auto frames = read(source);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].depth.at<float>(4, 4), 0.0F);
  EXPECT_FLOAT_EQ(frames[0].depth.at<float>(40, 40), 0.5F);
  EXPECT_EQ(source.notes().at("depth pixel at the end of the sensor's range, taken as unknown"), 64u);
}

TEST_F(TumFolder, RefusesWhatCannotBeRead) {
  EXPECT_THROW(TumSource(folder_ / "nowhere", camera_), InputError);
  EXPECT_THROW(TumSource(folder_, camera_), InputError);
  write("1 colour.png\n", "1 depth.png\n");
  EXPECT_NO_THROW(TumSource(folder_, camera_));
  for (const double bad : {-0.1, 10.0, std::numeric_limits<double>::quiet_NaN()}) {
    TumOptions options;
    options.max_time_difference = bad;
    EXPECT_THROW(TumSource(folder_, camera_, options), OptionsError);
  }
  Camera without_units = camera_;
  without_units.depth_units_per_metre = 0.0;
  EXPECT_THROW(TumSource(folder_, without_units), CalibrationError);
  camera_.fx = 0.0;
  EXPECT_THROW(TumSource(folder_, camera_), CalibrationError);
}

}  // namespace
}  // namespace roslam
