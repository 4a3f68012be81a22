// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/inference/plan/onnx_image_size.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/semantics/score_labels.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

fs::path test_model(const char* name) { return fs::path(ROSLAM_TEST_FILES) / name; }

TEST(LabelSet, GroupsOfEightAreThoseOfTheDataset) {
  const auto set = label_set_from("groups8");
  ASSERT_TRUE(set);
  const auto group = [&](int c) { return set->classes[set->from_class[static_cast<std::size_t>(c)]]; };
  EXPECT_EQ(group(0), "flat");
  EXPECT_EQ(group(4), "building");  // fence
  EXPECT_EQ(group(6), "pole");      // traffic light
  EXPECT_EQ(group(9), "nature");
  EXPECT_EQ(group(12), "person");  // rider
  EXPECT_EQ(group(17), "car");     // motorcycle
  EXPECT_EQ(group(18), "bicycle");
}

TEST(LabelSet, MovableClassesAreThoseOfTheAuxiliaryDescriptor) {
  for (int c = 0; c < 11; ++c) EXPECT_EQ(movable_of(c), Movable::kNone) << class_name(c);
  EXPECT_EQ(movable_of(11), Movable::kPerson);
  EXPECT_EQ(movable_of(12), Movable::kPerson);
  for (int c = 13; c < 18; ++c) EXPECT_EQ(movable_of(c), Movable::kCar) << class_name(c);
  EXPECT_EQ(movable_of(18), Movable::kBicycle);
  EXPECT_EQ(movable_of(255), Movable::kNone);
}

TEST(LabelSet, RelabelWritesTheValuesOfTheSetAndKeepsVoid) {
  const cv::Mat labels = (cv::Mat_<std::uint8_t>(1, 5) << 0, 11, 12, 18, 255);
  const auto values = [&](const char* name) {
    const cv::Mat out = relabel(labels, *label_set_from(name));
    return std::vector<int>(out.begin<std::uint8_t>(), out.end<std::uint8_t>());
  };
  EXPECT_EQ(values("cityscapes19"), (std::vector<int>{0, 11, 12, 18, 255}));
  EXPECT_EQ(values("groups8"), (std::vector<int>{0, 5, 5, 7, 255}));
  EXPECT_EQ(values("camvid11"), (std::vector<int>{3, 9, 10, 10, 255}));
  EXPECT_EQ(values("person"), (std::vector<int>{0, 255, 255, 0, 255}));
  EXPECT_FALSE(label_set_from("coco80"));
}

TEST(LabelSet, MovableMaskCoversPersonsCarsAndBicyclesOnly) {
  const cv::Mat labels = (cv::Mat_<std::uint8_t>(1, 6) << 10, 11, 13, 18, 0, 255);
  const cv::Mat mask = movable_mask(labels);
  EXPECT_EQ(std::vector<int>(mask.begin<std::uint8_t>(), mask.end<std::uint8_t>()),
            (std::vector<int>{0, 255, 255, 255, 0, 0}));
}

cv::Mat random_scores(int rows, int columns, unsigned seed) {
  const int size[] = {1, kClasses, rows, columns};
  cv::Mat scores(4, size, CV_32F);
  std::mt19937 generator(seed);
  std::normal_distribution<float> normal(0.0F, 3.0F);
  for (int c = 0; c < kClasses; ++c) {  // smooth, so that there are areas of one class as well as borders
    cv::Mat coarse(rows / 3 + 2, columns / 3 + 2, CV_32F);
    for (auto it = coarse.begin<float>(); it != coarse.end<float>(); ++it) *it = normal(generator);
    cv::Mat plane(rows, columns, CV_32F, scores.ptr<float>(0, c));
    cv::resize(coarse, plane, plane.size(), 0, 0, cv::INTER_CUBIC);
  }
  return scores;
}

// The definition, without shortcuts: every class interpolated at every pixel, in double precision.
struct Interpolated {
  double best;
  double second;
  int label;
};

Interpolated brute_force(const cv::Mat& scores, const cv::Size& size, int x, int y) {
  const auto side = [](int pixel, int pixels, int points) {
    const double position = std::max((pixel + 0.5) * points / pixels - 0.5, 0.0);
    const int first = std::min(static_cast<int>(position), points - 1);
    return std::tuple(first, std::min(first + 1, points - 1), position - first);
  };
  const auto [x0, x1, u] = side(x, size.width, scores.size[3]);
  const auto [y0, y1, v] = side(y, size.height, scores.size[2]);
  Interpolated result{-1e9, -1e9, -1};
  for (int c = 0; c < kClasses; ++c) {
    const auto at = [&](int row, int column) {
      return static_cast<double>(*(scores.ptr<float>(0, c) + row * scores.size[3] + column));
    };
    const double score =
        (1 - v) * ((1 - u) * at(y0, x0) + u * at(y0, x1)) + v * ((1 - u) * at(y1, x0) + u * at(y1, x1));
    if (score > result.best) {
      result = {score, result.best, c};
    } else {
      result.second = std::max(result.second, score);
    }
  }
  return result;
}

class ScoreLabels : public testing::TestWithParam<cv::Size> {};

TEST_P(ScoreLabels, AreTheBestClassAfterBilinearInterpolation) {
  const cv::Mat scores = random_scores(18, 24, 7);
  const Segmentation result = labels_from_scores(ScoreGrid::from_planes(scores), GetParam());
  ASSERT_EQ(result.labels.size(), GetParam());
  int different = 0;
  for (int y = 0; y < result.labels.rows; ++y) {
    for (int x = 0; x < result.labels.cols; ++x) {
      const Interpolated truth = brute_force(scores, GetParam(), x, y);
      if (result.labels.at<std::uint8_t>(y, x) != truth.label && truth.best - truth.second > 1e-4)
        ++different;
    }
  }
  EXPECT_EQ(different, 0);
}

INSTANTIATE_TEST_SUITE_P(Sizes, ScoreLabels,
                         testing::Values(cv::Size(96, 72), cv::Size(640, 480), cv::Size(24, 18),
                                         cv::Size(7, 5), cv::Size(1, 1), cv::Size(301, 17)),
                         [](const auto& size) {
                           return std::to_string(size.param.width) + "x" + std::to_string(size.param.height);
                         });

TEST(ScoreLabels, ConfidenceIsTheMeanProbabilityWhereAClassWasChosen) {
  const int size[] = {1, kClasses, 1, 2};
  cv::Mat scores(4, size, CV_32F, cv::Scalar(0));
  scores.ptr<float>(0, 11)[0] = 2.0F;
  scores.ptr<float>(0, 11)[1] = 4.0F;
  const auto probability = [](double score) { return std::exp(score) / (std::exp(score) + kClasses - 1); };
  const Segmentation result = labels_from_scores(ScoreGrid::from_planes(scores), {2, 1});
  EXPECT_NEAR(result.confidence[11], 0.5 * (probability(2.0) + probability(4.0)), 1e-5);
  EXPECT_EQ(result.confidence[0], 0.0F);
}

TEST(WorkingSize, LongerSideIsAsAskedAndBothAreMultiplesOf32) {
  EXPECT_EQ(working_size({640, 480}, 384), cv::Size(384, 288));
  EXPECT_EQ(working_size({480, 640}, 384), cv::Size(288, 384));
  EXPECT_EQ(working_size({256, 256}, 256), cv::Size(256, 256));
  EXPECT_EQ(working_size({1, 1}, 64), cv::Size(64, 64));
  EXPECT_EQ(working_size({7680, 1}, 384), cv::Size(384, 32));
  EXPECT_EQ(working_size({1280, 720}, 384), cv::Size(384, 224));
}

// Red, green and blue stripes, which the test network takes for person, vegetation and sky.
cv::Mat stripes(int width, int height) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(0, 0, 255));
  image.colRange(width / 3, 2 * width / 3) = cv::Scalar(0, 255, 0);
  image.colRange(2 * width / 3, width) = cv::Scalar(255, 0, 0);
  return image;
}

TEST(PspnetSegmenter, LabelsTheColoursItsNetworkKnows) {
  PspnetSegmenter segmenter(test_model("colours.onnx"), {}, InferenceBackend::kOpenCv);
  const cv::Mat image = stripes(640, 480);
  const Segmentation result = segmenter.segment(image);
  ASSERT_EQ(result.labels.size(), image.size());
  ASSERT_EQ(result.labels.type(), CV_8UC1);
  for (const int x : {10, 100, 200}) EXPECT_EQ(result.labels.at<std::uint8_t>(240, x), 11) << x;
  for (const int x : {225, 320, 415}) EXPECT_EQ(result.labels.at<std::uint8_t>(240, x), 8) << x;
  for (const int x : {440, 550, 630}) EXPECT_EQ(result.labels.at<std::uint8_t>(240, x), 10) << x;
  EXPECT_GT(result.confidence[11], 0.9F);
  EXPECT_GT(result.seconds, 0.0);
}

TEST(PspnetSegmenter, GivesTheSameLabelsAgain) {
  PspnetSegmenter segmenter(test_model("colours.onnx"), {}, InferenceBackend::kOpenCv);
  cv::Mat image(480, 640, CV_8UC3);
  cv::theRNG().state = 5;
  cv::randu(image, 0, 256);
  const Segmentation first = segmenter.segment(image);
  segmenter.segment(stripes(300, 200));  // another size in between
  const Segmentation again = segmenter.segment(image);
  EXPECT_EQ(cv::norm(first.labels, again.labels, cv::NORM_INF), 0.0);
  EXPECT_EQ(first.confidence, again.confidence);
}

TEST(PspnetSegmenter, TakesImagesOfAnySizeAndKind) {
  PspnetSegmenter segmenter(test_model("colours.onnx"), {}, InferenceBackend::kOpenCv);
  const cv::Mat white(1, 1, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(segmenter.segment(white).labels.at<std::uint8_t>(0, 0), 13);
  const Segmentation large = segmenter.segment(cv::Mat(4320, 7680, CV_8UC3, cv::Scalar(0, 0, 255)));
  EXPECT_EQ(large.labels.size(), cv::Size(7680, 4320));
  EXPECT_EQ(cv::countNonZero(large.labels != 11), 0);
  const Segmentation alpha = segmenter.segment(cv::Mat(48, 64, CV_8UC4, cv::Scalar(255, 0, 0, 0)));
  EXPECT_EQ(cv::countNonZero(alpha.labels != 10), 0);
  const Segmentation thin = segmenter.segment(cv::Mat(3, 2000, CV_8UC3, cv::Scalar(0, 0, 0)));
  EXPECT_EQ(cv::countNonZero(thin.labels != 0), 0);
}

TEST(PspnetSegmenter, RefusesWhatIsNoImage) {
  PspnetSegmenter segmenter(test_model("colours.onnx"), {}, InferenceBackend::kOpenCv);
  EXPECT_THROW(segmenter.segment({}), InputError);
  EXPECT_THROW(segmenter.segment(cv::Mat(48, 64, CV_32FC3)), InputError);
  EXPECT_THROW(segmenter.segment(cv::Mat(48, 64, CV_16UC1)), InputError);
}

TEST(SegmenterOptions, RefuseASideNoNetworkCanWorkAt) {
  EXPECT_THROW(SegmenterOptions{16}.validate(), OptionsError);
  EXPECT_THROW(SegmenterOptions{100000}.validate(), OptionsError);
  EXPECT_NO_THROW(SegmenterOptions{32}.validate());
}

std::string reason_to_refuse(const fs::path& model, InferenceBackend backend = InferenceBackend::kOpenCv) {
  try {
    const PspnetSegmenter segmenter(model, {}, backend);
  } catch (const ModelError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BadModel, IsNamedWithWhatWasExpected) {
  const std::string missing = reason_to_refuse("no/such.onnx");
  EXPECT_NE(missing.find("no/such.onnx: no such model file"), std::string::npos) << missing;
  EXPECT_NE(reason_to_refuse(fs::temp_directory_path()).find("no such model file"), std::string::npos);
  const std::string classes = reason_to_refuse(test_model("eleven.onnx"));
  EXPECT_NE(classes.find("eleven.onnx: gives 11 classes where the 19"), std::string::npos) << classes;
  const std::string channels = reason_to_refuse(test_model("grey.onnx"));
  EXPECT_NE(channels.find("grey.onnx: the network cannot be run"), std::string::npos) << channels;
  const std::string numbers = reason_to_refuse(test_model("nan.onnx"));
  EXPECT_NE(numbers.find("nan.onnx: gives scores that are not finite"), std::string::npos) << numbers;
}

TEST(BadModel, DamagedFilesAreRefusedAtAnyLength) {
  const std::string whole = content(test_model("colours.onnx"));
  const auto file = scratch_path(".onnx");
  for (std::size_t length = 0; length < whole.size(); length += 37) {
    std::ofstream(file, std::ios::binary) << whole.substr(0, length);
    EXPECT_NE(reason_to_refuse(file), "accepted") << length;
  }
  std::ofstream(file, std::ios::binary) << std::string(5000, '\xff');
  EXPECT_NE(reason_to_refuse(file).find("damaged"), std::string::npos);
  fs::remove(file);
}

TEST(BadModel, TheOnnxRuntimeBackendIsMissedClearlyWhereItWasNotBuilt) {
  if (has_onnx_runtime()) GTEST_SKIP() << "this build has ONNX Runtime";
  const std::string reason = reason_to_refuse(test_model("colours.onnx"), InferenceBackend::kOnnxRuntime);
  EXPECT_NE(reason.find("no ONNX Runtime"), std::string::npos) << reason;
}

TEST(OnnxImageSize, IsLeftOpenInPlaceAndNothingElseChanges) {
  const std::string before = content(test_model("colours.onnx"));
  const std::string after = with_open_image_size(before);
  ASSERT_EQ(after.size(), before.size());
  // 288 and 384 of the input: two dimensions of three bytes each. Those of the output have one byte and stay.
  std::size_t changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) changed += before[i] != after[i] ? 1U : 0U;
  EXPECT_EQ(changed, 6U);
  EXPECT_NE(after.find(std::string("\x12\x01h")), std::string::npos);
  EXPECT_NE(after.find(std::string("\x12\x01i")), std::string::npos);
  for (std::size_t length = 0; length < before.size(); length += 13) {
    EXPECT_EQ(with_open_image_size(before.substr(0, length)).size(), length);
  }
  EXPECT_EQ(with_open_image_size("no network"), "no network");
}

TEST(OnnxRuntime, GivesTheLabelsOfOpenCv) {
  if (!has_onnx_runtime()) GTEST_SKIP() << "built without ONNX Runtime";
  PspnetSegmenter opencv(test_model("colours.onnx"), {}, InferenceBackend::kOpenCv);
  PspnetSegmenter runtime(test_model("colours.onnx"), {}, InferenceBackend::kOnnxRuntime);
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(100, 300), cv::Size(640, 480)}) {
    const cv::Mat image = stripes(size.width, size.height);
    EXPECT_EQ(cv::norm(opencv.segment(image).labels, runtime.segment(image).labels, cv::NORM_INF), 0.0);
  }
}

TEST(Overlay, TintsMovableThingsMoreThanWhatStands) {
  const cv::Mat image(10, 10, CV_8UC3, cv::Scalar(128, 128, 128));
  cv::Mat labels(10, 10, CV_8UC1, cv::Scalar(2));
  labels(cv::Rect(5, 0, 5, 10)) = 11;
  const cv::Mat overlay = label_overlay(image, labels);
  const cv::Vec3b person = overlay.at<cv::Vec3b>(5, 8);
  EXPECT_GT(person[2], 170);
  EXPECT_LT(person[0], 100);
  EXPECT_LT(cv::norm(overlay.at<cv::Vec3b>(5, 2), image.at<cv::Vec3b>(5, 2)), 30.0);
  EXPECT_THROW(label_overlay(image, labels(cv::Rect(0, 0, 5, 5))), InputError);
}

}  // namespace
}  // namespace roslam
