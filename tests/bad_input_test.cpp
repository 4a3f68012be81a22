// SPDX-License-Identifier: BSD-3-Clause
// Damaged recordings: the program reports one error, or skips and counts the damaged frames.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/street.hpp"

namespace roslam::street {
namespace {

using nlohmann::json;

std::string first_half(const fs::path& file) {
  const std::string bytes = content(file);
  return bytes.substr(0, bytes.size() / 2);
}

cv::Mat half_size(const fs::path& file) {
  cv::Mat small;
  cv::resize(cv::imread(file.string(), cv::IMREAD_UNCHANGED), small, {320, 240}, 0, 0, cv::INTER_NEAREST);
  return small;
}

class BadLists : public Dataset {};
class BadImages : public Dataset {};
class BadDepth : public Dataset {};

TEST_F(BadLists, NamesWhatIsMissing) {
  fs::remove(data_ / "depth.txt");
  expect_refused(run(), {"depth.txt", "cannot open it"});
  fs::remove(data_ / "rgb.txt");
  expect_refused(run(), {"rgb.txt", "cannot open it"});
  fs::create_directory(data_ / "rgb.txt");
  expect_refused(run(), {"rgb.txt", "cannot open it"});
  fs::remove_all(data_);
  expect_refused(run(), {data_.string(), "no such folder"});
  put(data_, "a file where a folder should be");
  expect_refused(run(), {data_.string(), "no such folder"});
}

TEST_F(BadLists, NamesTheLineThatIsMalformed) {
  for (const std::string line : {"soon rgb/a.png", "0.5", "0,5 rgb/a.png", "rgb/a.png 0.5", "0.5rgb/a.png",
                                 "\x89PNG\x1a\x1b\x01 \x02\x03"}) {
    put(data_ / "rgb.txt", "# a comment\n" + line + "\n");
    expect_refused(run(), {"rgb.txt:2: expected 'timestamp file'", "correct or remove the line"});
  }
  put(data_ / "rgb.txt", std::string(100000, 'x'));
  const Outcome outcome = run();
  expect_refused(outcome, {"rgb.txt:1:"});
  EXPECT_LT(outcome.error.size(), 1000u);
}

TEST_F(BadLists, NamesTheListThatIsEmpty) {
  for (const char* list : {"rgb.txt", "depth.txt"}) {
    for (const char* text : {"", "\n \n", "# timestamp filename\r\n", "nan rgb/a.png\n"}) {
      write_lists();
      put(data_ / list, text);
      expect_refused(run(), {list, "names no image"});
    }
  }
}

TEST_F(BadLists, ReadsListsFromWindowsWithCommentsAndBlankLines) {
  put(data_ / "rgb.txt",
      "\xef\xbb\xbf# made by an editor\r\n\r\n \t\r\n  # indented\r\n" + text_of(colour_, "\r\n"));
  put(data_ / "depth.txt", "\xef\xbb\xbf" + depth_[0].time + "\t" + depth_[0].file + "\r\n" +
                               text_of({depth_.begin() + 1, depth_.end()}, "\r\n"));
  const json frames = frames_of_run();
  EXPECT_EQ(frames["tracked"], kFrames);
  EXPECT_EQ(frames["without_depth"], 0);
}

TEST_F(BadLists, SkipsAndCountsCorruptTimes) {
  colour_[2].time = "99999.0";        // the clock jumps and comes back
  colour_[4].time = colour_[3].time;  // stands still
  colour_[6].time = "0.000001";       // jumps back
  colour_[7].time = "nan";
  colour_[8].time = "inf";
  write_lists();
  const json frames = frames_of_run();
  EXPECT_EQ(frames["in_source"], kFrames);
  EXPECT_EQ(frames["skipped"]["colour image with a time that does not fit the others"], 2);
  EXPECT_EQ(frames["skipped"]["colour image with the time of another"], 1);
  EXPECT_EQ(frames["skipped"]["colour image without a time"], 2);
  EXPECT_EQ(frames["tracked"], 5);
  const Trajectory poses = trajectory();
  ASSERT_EQ(poses.size(), 5u);
  for (std::size_t i = 1; i < poses.size(); ++i) EXPECT_GT(poses[i].timestamp, poses[i - 1].timestamp);
}

TEST_F(BadLists, AGapOfDaysIsNoReasonToWait) {
  for (std::size_t i = 5; i < kFrames; ++i) {
    const std::string later = std::to_string(1e6 + time_of(i));
    colour_[i].time = later;
    depth_[i].time = later;
  }
  write_lists();
  EXPECT_EQ(frames_of_run()["tracked"], kFrames);
  const json frames = frames_of_run("--real-time");
  EXPECT_EQ(frames["processed"].get<std::size_t>() + frames["dropped"].get<std::size_t>(), kFrames);
  EXPECT_LT(report()["wall_seconds"], 10.0);
}

TEST_F(BadImages, SkipsAndCountsEachKindOfDamage) {
  fs::remove(colour(1));
  put(colour(2), first_half(colour(2)));
  put(colour(3), "Not found");
  put(colour(4), "");
  fs::remove(colour(5));
  fs::create_directory(colour(5));
  put_image(colour(6), half_size(colour(6)));
  cv::imwrite((data_ / "rgb/7.jpg").string(), cv::imread(colour(7).string()));
  put(data_ / "rgb/7.jpg", first_half(data_ / "rgb/7.jpg"));
  colour_[7].file = "rgb/7.jpg";
  write_lists();
  const json frames = frames_of_run();
  EXPECT_EQ(frames["skipped"], json({{"colour image is missing", 1},
                                     {"colour image is truncated", 3},
                                     {"colour image cannot be decoded", 1},
                                     {"colour image cannot be read", 1},
                                     {"colour image is 320x240 but the camera 640x480 pixels", 1}}));
  EXPECT_EQ(frames["tracked"], 3);
  EXPECT_EQ(frames["in_source"], kFrames);
}

TEST_F(BadImages, DamageInTheMiddleOfAFileIsFound) {
  std::string bytes = content(colour(3));
  for (std::size_t i = bytes.size() / 3; i < bytes.size() / 3 + 2000; ++i) bytes[i] = 'x';
  put(colour(3), bytes);
  const Outcome outcome = run();
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(report()["frames"]["skipped"], json({{"colour image cannot be decoded", 1}}));
}

TEST_F(BadImages, ReadsJpegAsWellAsPng) {
  for (std::size_t i = 0; i < kFrames; ++i) {
    const std::string file = "rgb/" + std::to_string(i) + ".jpg";
    cv::imwrite((data_ / file).string(), cv::imread(colour(i).string()), {cv::IMWRITE_JPEG_QUALITY, 95});
    colour_[i].file = file;
  }
  write_lists();
  EXPECT_EQ(frames_of_run()["tracked"], kFrames);
}

TEST_F(BadImages, AllMissingIsAnErrorAndTheReportSaysSo) {
  fs::remove_all(data_ / "rgb");
  expect_refused(run(), {data_.string(), "no frame could be used", "10 x colour image is missing"});
  EXPECT_EQ(report()["frames"]["processed"], 0);
  EXPECT_EQ(report()["frames"]["skipped"]["colour image is missing"], kFrames);
  EXPECT_TRUE(fs::exists(run_ / "trajectory.txt"));
}

TEST_F(BadImages, AllOfAnotherSizeThanTheCameraIsAnErrorWithBothSizes) {
  put(scratch_ / "small.yaml", "width: 320\nheight: 240\nfx: 190\nfy: 190\ncx: 160\ncy: 120\ndepth_units_per_metre: 1000\n");
  expect_refused(
      run("", (scratch_ / "small.yaml").string()),
      {"10 x colour image is 640x480 but the camera 320x240 pixels", "check the images and --camera"});
  EXPECT_EQ(report()["frames"]["processed"], 0);
}

TEST_F(BadImages, AllBlackIsAnErrorAndAllIsWritten) {
  for (std::size_t i = 0; i < kFrames; ++i) put_image(colour(i), cv::Mat::zeros(480, 640, CV_8UC3));
  expect_refused(run(), {data_.string(), "no frame could be tracked", "corners of known depth"});
  EXPECT_EQ(report()["frames"]["by_state"], json({{"initialising", kFrames}}));
  EXPECT_EQ(report()["frames"]["tracked"], 0);
  for (const char* file : {"trajectory.txt", "keyframes.txt", "map.ply"})
    EXPECT_TRUE(fs::exists(run_ / file)) << file;
}

TEST_F(BadDepth, FramesWithDamagedDepthAreTrackedWithoutIt) {
  fs::remove(depth(1));
  put(depth(2), first_half(depth(2)));
  put(depth(3), "Not found");
  put(depth(4), "");
  put_image(depth(5), cv::Mat(480, 640, CV_8UC1, cv::Scalar(50)));
  put_image(depth(6), half_size(depth(6)));
  depth_[7].time = "5.0";
  depth_[8].time = "nan";
  std::swap(depth_[7], depth_[9]);
  write_lists();
  const json frames = frames_of_run();
  EXPECT_EQ(frames["skipped"], json::object());
  EXPECT_EQ(frames["skipped_depth"], json({{"depth image is missing", 1},
                                           {"depth image is truncated", 2},
                                           {"depth image cannot be decoded", 1},
                                           {"depth image is not a 16-bit grey image", 1},
                                           {"depth image is 320x240 but the colour image 640x480 pixels", 1},
                                           {"depth image without a time", 1},
                                           {"no depth image near in time", 2}}));
  EXPECT_EQ(frames["without_depth"], 8);
  EXPECT_EQ(frames["tracked"], kFrames);
}

TEST_F(BadDepth, NoneAtAllIsAnErrorThatSaysDepthIsNeeded) {
  for (auto& line : depth_) line.time = std::to_string(std::stod(line.time) + 100.0);
  write_lists();
  expect_refused(run(), {"no frame could be tracked", "none has depth", "10 x no depth image near in time"});
  EXPECT_EQ(report()["frames"]["without_depth"], kFrames);
}

TEST_F(BadDepth, AllZeroIsAnErrorThatSaysWhatToCheck) {
  for (std::size_t i = 0; i < kFrames; ++i) put_image(depth(i), cv::Mat::zeros(480, 640, CV_16UC1));
  expect_refused(run(), {"no frame could be tracked", "known depth", "depth_units_per_metre"});
}

TEST_F(BadDepth, TrackingBeginsWithTheFirstDepth) {
  for (std::size_t i = 0; i < 4; ++i) fs::remove(depth(i));
  const json frames = frames_of_run();
  EXPECT_EQ(frames["by_state"], json({{"initialising", 4}, {"tracking", kFrames - 4}}));
  EXPECT_EQ(trajectory().front().timestamp, time_of(4));
}

}  // namespace
}  // namespace roslam::street
