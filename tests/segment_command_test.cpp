// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

// The program with a network that knows colours: red is person, green vegetation, blue sky.
class SegmentCommand : public testing::Test {
 protected:
  SegmentCommand() : folder_(scratch_path()) { fs::create_directories(folder_); }
  ~SegmentCommand() override { fs::remove_all(folder_); }

  Outcome segment(const std::string& arguments,
                  const std::string& model = ROSLAM_TEST_FILES "/colours.onnx") {
    return shell_in(folder_,
                    std::string(ROSLAM_PROGRAM) + " segment " + arguments + " --model '" + model + "'");
  }

  static cv::Mat image(const cv::Scalar& left, const cv::Scalar& right) {
    cv::Mat image(96, 128, CV_8UC3, left);
    image.colRange(64, 128) = right;
    return image;
  }

  void put(const std::string& file, const cv::Mat& image) {
    fs::create_directories((folder_ / file).parent_path());
    cv::imwrite((folder_ / file).string(), image);
  }

  cv::Mat labels(const std::string& file) {
    return cv::imread((folder_ / file).string(), cv::IMREAD_UNCHANGED);
  }

  const cv::Scalar kRed{0, 0, 255};
  const cv::Scalar kGreen{0, 255, 0};
  fs::path folder_;
};

TEST_F(SegmentCommand, WritesLabelsNamedAsTheImages) {
  put("in/first.png", image(kRed, kGreen));
  put("in/second.jpg", image(kGreen, kRed));
  const Outcome outcome = segment("in --out out --classes person --overlay --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const cv::Mat first = labels("out/first.png");
  ASSERT_EQ(first.size(), cv::Size(128, 96));
  ASSERT_EQ(first.type(), CV_8UC1);
  EXPECT_EQ(first.at<std::uint8_t>(40, 20), 255);
  EXPECT_EQ(first.at<std::uint8_t>(40, 110), 0);
  EXPECT_EQ(labels("out/second.png").at<std::uint8_t>(40, 110), 255);
  EXPECT_EQ(labels("out/overlay/first.jpg").size(), cv::Size(128, 96));
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["images"], 2);
  EXPECT_EQ(json["classes"], "person");
  EXPECT_NEAR(json["by_class"]["person"]["share"].get<double>(), 0.5, 0.02);
  EXPECT_EQ(nlohmann::json::parse(content(folder_ / "out/labels.json"))["classes"], "person");
}

TEST_F(SegmentCommand, LabelsAreScoredByEvaluate) {
  put("in/a.png", image(kRed, kGreen));
  ASSERT_EQ(segment("in --out out").code, 0);
  cv::Mat truth(96, 128, CV_8UC1, cv::Scalar(11));
  truth.colRange(64, 128) = 8;
  put("truth/a.png", truth);
  const Outcome outcome =
      shell_in(folder_, std::string(ROSLAM_PROGRAM) +
                            " evaluate segmentation --truth truth --estimate out --classes groups8 --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_GT(json["mean_iou"].get<double>(), 0.97);
  EXPECT_TRUE(json["by_class"]["car"]["iou"].is_null());
}

TEST_F(SegmentCommand, ReadsTumFolders) {
  put("tum/rgb/1.500000.png", image(kRed, kRed));
  put("tum/rgb/unlisted.png", image(kRed, kRed));
  std::ofstream(folder_ / "tum/rgb.txt") << "# timestamp filename\n1.500000 rgb/1.500000.png\n";
  ASSERT_EQ(segment("tum --out out").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out/1.500000.png"));
  EXPECT_FALSE(fs::exists(folder_ / "out/unlisted.png"));
}

TEST_F(SegmentCommand, ReadsVideos) {
  cv::VideoWriter video((folder_ / "flight.avi").string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                        {128, 96});
  if (!video.isOpened()) GTEST_SKIP() << "this OpenCV writes no video";
  for (int i = 0; i < 3; ++i) video.write(image(kRed, kGreen));
  video.release();
  const Outcome outcome = segment("flight.avi --out out --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["images"], 3);
  EXPECT_EQ(labels("out/000002.png").at<std::uint8_t>(40, 20), 11);
}

TEST_F(SegmentCommand, SkipsWhatCannotBeReadAndCountsIt) {
  put("in/good.png", image(kRed, kGreen));
  std::ofstream(folder_ / "in/bad.png") << "no image";
  put("in/cut.jpg", image(kRed, kGreen));
  fs::resize_file(folder_ / "in/cut.jpg", fs::file_size(folder_ / "in/cut.jpg") / 2);
  const Outcome outcome = segment("in --out out --json");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["images"], 1);
  EXPECT_EQ(json["skipped"]["image cannot be decoded"], 1);
  EXPECT_EQ(json["skipped"]["image is truncated"], 1);
}

TEST_F(SegmentCommand, TellsWhatIsWrongInOneLine) {
  put("in/a.png", image(kRed, kGreen));
  put("twice/a.jpg", image(kRed, kGreen));
  fs::create_directories(folder_ / "empty");
  std::ofstream(folder_ / "only.png") << "no image";
  std::ofstream(folder_ / "no.mp4") << "no video";
  std::ofstream(folder_ / "file") << "";
  const auto fails = [&](const std::string& arguments, const std::string& reason) {
    const Outcome outcome = segment(arguments);
    EXPECT_EQ(outcome.code, 1) << arguments;
    EXPECT_NE(outcome.error.find(reason), std::string::npos) << arguments << ": " << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  };
  fails("nowhere.png --out out", "nowhere.png: no such image");
  fails("empty --out out", "empty: holds no images");
  fails("in twice --out out", "a.jpg: has the same name as in/a.png");
  fails("only.png --out out", "only.png: no image could be labelled; 1 x image cannot be decoded");
  fails("no.mp4 --out out", "no.mp4: is no video");
  fails("in no.mp4 --out out", "no.mp4: a video must be given alone");
  fails("in --out in", "in: holds the images");
  put("out/overlay/a.png", image(kRed, kGreen));
  fails("out/overlay --out out --overlay", "overlay: holds the images");
  put("tum/colour/a.png", image(kRed, kGreen));
  std::ofstream(folder_ / "tum/rgb.txt") << "1.0 colour/a.png\n";
  std::ofstream(folder_ / "tum/depth.txt") << "";
  fails("tum --out tum/colour", "colour: holds the images");
  fails("in --out file", "file: cannot create the output folder");
  EXPECT_EQ(segment("in --out out --classes coco").code, 2);
  EXPECT_EQ(segment("in --out out --working-side 5").code, 2);
  EXPECT_EQ(segment("in").code, 2);
}

TEST_F(SegmentCommand, TellsOfABadModelInOneLine) {
  put("in/a.png", image(kRed, kGreen));
  std::ofstream(folder_ / "empty.onnx") << "";
  const auto fails = [&](const std::string& model, const std::string& reason) {
    const Outcome outcome = segment("in --out out", model);
    EXPECT_EQ(outcome.code, 1) << model;
    EXPECT_NE(outcome.error.find(reason), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  };
  fails("none.onnx", "none.onnx: no such model file");
  fails("empty.onnx", "empty.onnx: is empty");
  fails("in/a.png", "in/a.png: is damaged");
  fails(ROSLAM_TEST_FILES "/eleven.onnx", "11 classes");
}

TEST_F(SegmentCommand, TellsOfAImageTooLargeForTheMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers reserve more address space than the limit of this test";
#endif
  cv::imwrite((folder_ / "large.png").string(), cv::Mat(14000, 14000, CV_8UC1, cv::Scalar(0)));
  const Outcome outcome =
      shell_in(folder_, "export OPENBLAS_NUM_THREADS=1; ulimit -v 700000; " ROSLAM_PROGRAM
                        " segment large.png --out out --model " ROSLAM_TEST_FILES "/colours.onnx");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.error.find("large.png: needs more memory"), std::string::npos) << outcome.error;
}

}  // namespace
}  // namespace roslam
