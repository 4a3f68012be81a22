// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_check.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/datasets/tum_source.hpp"

namespace roslam {
namespace {

struct Images {
  cv::Mat grey;
  cv::Mat depth;
};

// A camera that pans past boxes before a wall: 30 images a second, five pixels an image.
class PannedBoxes {
 public:
  PannedBoxes() {
    std::mt19937 random(3);
    const auto pick = [&](int low, int high) {
      return std::uniform_int_distribution<int>(low, high)(random);
    };
    for (int y = 0; y < grey_.rows; ++y) {
      for (int x = 0; x < grey_.cols; ++x)
        depth_.at<float>(y, x) = 3.0F + 0.0005F * static_cast<float>(x + y);
    }
    for (int box = 0; box < 60; ++box) {
      const cv::Rect at(pick(0, grey_.cols - 200), pick(0, 300), pick(60, 160), pick(60, 160));
      depth_(at) = 1.0F + 0.02F * static_cast<float>(box);
      grey_(at) = pick(30, 220);
    }
  }

  Images at(int frame) const {
    const cv::Rect window(5 * (frame + 40), 0, 640, 480);
    Images images;
    cv::cvtColor(cv::Mat(grey_(window)), images.grey, cv::COLOR_GRAY2BGR);
    cv::cvtColor(images.grey, images.grey, cv::COLOR_BGR2GRAY);
    images.depth = depth_(window).clone();
    return images;
  }

 private:
  cv::Mat grey_ = cv::Mat(480, 2400, CV_8UC1, cv::Scalar(128));
  cv::Mat depth_ = cv::Mat(480, 2400, CV_32FC1);
};

using Change = std::function<cv::Mat(int frame)>;  // to the depth given with a frame

std::string alarms_of(const Change& depth_at, bool is_troubled = false) {
  const PannedBoxes scene;
  DepthCheck check(525.0);
  for (int frame = 0; frame < 140; ++frame) {
    check.add(scene.at(frame).grey, depth_at(frame), frame / 30.0);
    check.note_tracking(true, is_troubled && frame % 2 == 0);
  }
  std::string all;
  for (const auto& alarm : check.alarms()) all += alarm + "\n";
  return all;
}

cv::Mat flipped(const cv::Mat& depth, int code) {
  cv::Mat result;
  cv::flip(depth, result, code);
  return result;
}

TEST(DepthCheck, IsSilentWhereDepthBelongsToColour) {
  const PannedBoxes scene;
  EXPECT_EQ(alarms_of([&](int i) { return scene.at(i).depth; }), "");
  EXPECT_EQ(alarms_of([&](int i) { return scene.at(i).depth; }, true), "") << "keyframes alone are no fault";
  EXPECT_EQ(alarms_of([&](int i) { return cv::Mat(i % 2 == 0 ? scene.at(i).depth : cv::Mat()); }), "");
  EXPECT_EQ(alarms_of([&](int i) { return scene.at(i + 2).depth; }), "") << "the delay of a real sensor";
}

TEST(DepthCheck, IsSilentWithoutEvidence) {
  const PannedBoxes scene;
  const auto mirrored = [&] { return flipped(scene.at(0).depth, 1); };
  DepthCheck at_rest(525.0);
  for (int frame = 0; frame < 200; ++frame) at_rest.add(scene.at(0).grey, mirrored(), frame / 30.0);
  EXPECT_TRUE(at_rest.alarms().empty()) << "the same image again is no further evidence";
  EXPECT_EQ(alarms_of([](int) { return cv::Mat::zeros(480, 640, CV_32FC1); }), "") << "nothing in range";
  const auto sparse = [&](int i) {
    cv::Mat depth = cv::Mat::zeros(480, 640, CV_32FC1);
    for (int y = 0; y < 480; y += 40) scene.at(i).depth.row(y).copyTo(depth.row(y));
    return depth;
  };
  EXPECT_EQ(alarms_of(sparse), "");
}

TEST(DepthCheck, AGapInTheMiddleDoesNoHarm) {
  const PannedBoxes scene;
  DepthCheck check(525.0);
  for (int frame = 0; frame < 140; ++frame)
    check.add(scene.at(frame).grey, scene.at(std::max(frame - 15, 0)).depth,
              frame / 30.0 + (frame > 63 ? 3.0 : 0.0));
  ASSERT_LE(check.alarms().size(), 1u);
}

TEST(DepthCheck, NamesWhatIsWrong) {
  const PannedBoxes scene;
  const auto depth = [&](int i) { return scene.at(i).depth; };
  std::mt19937 random(1);
  const std::vector<std::pair<std::string, Change>> faults{
      {"mirrored left to right", [&](int i) { return flipped(depth(i), 1); }},
      {"mirrored upside down", [&](int i) { return flipped(depth(i), 0); }},
      {"turned by 180 degrees", [&](int i) { return flipped(depth(i), -1); }},
      {"lag behind the colour images by about 0.5 s", [&](int i) { return depth(i - 15); }},
      {"are ahead of the colour images by about 0.5 s", [&](int i) { return depth(i + 15); }},
      {"does not change", [&](int) { return depth(0); }},
      {"same all over the image", [&](int) { return cv::Mat(480, 640, CV_32FC1, cv::Scalar(2.0)); }},
      {"implausibly small", [&](int i) { return cv::Mat(depth(i) / 9.0); }}};
  for (const auto& [words, change] : faults) {
    const std::string alarms = alarms_of(change);
    EXPECT_NE(alarms.find(words), std::string::npos) << words << ": " << alarms;
    EXPECT_EQ(std::count(alarms.begin(), alarms.end(), '\n'), 1) << words << ": " << alarms;
  }
}

TEST(DepthCheck, DepthOfAnotherSceneIsNoticedWhereTrackingSuffers) {
  const PannedBoxes scene;
  const auto of_another = [&](int i) { return flipped(scene.at(300 - 2 * i).depth, 0); };
  EXPECT_NE(alarms_of(of_another, true).find("do not belong"), std::string::npos);
  EXPECT_EQ(alarms_of(of_another, false), "");
}

// Real sequences, as they are and with wrong depth.
class DepthCheckOnRecordings : public testing::TestWithParam<std::pair<const char*, const char*>> {
 protected:
  std::vector<Images> images(std::size_t count) const {
    const std::filesystem::path folder = std::filesystem::path(ROSLAM_TEST_DATA) / "slam" / GetParam().first;
    std::vector<Images> all;
    if (!TumSource::recognises(folder)) return all;
    TumSource source(folder, *camera_preset(GetParam().second));
    while (all.size() < count) {
      const auto frame = source.next();
      if (!frame) break;
      Images images;
      cv::cvtColor(frame->colour, images.grey, cv::COLOR_BGR2GRAY);
      images.depth = frame->depth.empty() ? cv::Mat::zeros(frame->colour.size(), CV_32FC1) : frame->depth;
      all.push_back(images);
    }
    return all;
  }
};

TEST_P(DepthCheckOnRecordings, NamesWhatIsWrongAndNothingElse) {
  const auto frames = images(140);
  if (frames.empty()) GTEST_SKIP() << GetParam().first << " is not at hand";
  const auto alarms = [&](const std::function<cv::Mat(std::size_t)>& depth_at) {
    DepthCheck check(camera_preset(GetParam().second)->fx);
    for (std::size_t i = 15; i + 15 < frames.size(); ++i) {
      check.add(frames[i].grey, depth_at(i), static_cast<double>(i) / 30.0);
      check.note_tracking(true, i % 8 == 0);
    }
    std::string all;
    for (const auto& alarm : check.alarms()) all += alarm + "\n";
    return all;
  };
  EXPECT_EQ(alarms([&](std::size_t i) { return frames[i].depth; }), "");
  const std::vector<std::pair<std::string, std::function<cv::Mat(std::size_t)>>> faults{
      {"mirrored left to right", [&](std::size_t i) { return flipped(frames[i].depth, 1); }},
      {"mirrored upside down", [&](std::size_t i) { return flipped(frames[i].depth, 0); }},
      {"lag behind the colour images", [&](std::size_t i) { return frames[i - 15].depth; }},
      {"are ahead of the colour images", [&](std::size_t i) { return frames[i + 15].depth; }},
      {"does not change", [&](std::size_t) { return frames[0].depth; }},
      {"implausibly small", [&](std::size_t i) { return cv::Mat(frames[i].depth / 5.0); }},
      {"implausibly large", [&](std::size_t i) { return cv::Mat(frames[i].depth * 5.0); }}};
  for (const auto& [words, change] : faults)
    EXPECT_NE(alarms(change).find(words), std::string::npos) << words << ": " << alarms(change);
}

INSTANTIATE_TEST_SUITE_P(Sequences, DepthCheckOnRecordings,
                         testing::Values(std::pair("fr1_rpy", "tum-fr1"), std::pair("kitchen", "7scenes")),
                         [](const auto& parameter) { return std::string(parameter.param.first); });

}  // namespace
}  // namespace roslam
