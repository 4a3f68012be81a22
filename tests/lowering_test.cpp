// SPDX-License-Identifier: BSD-3-Clause
// ONNX files to plans: the networks that come with the program, those the kernels lack, hostile ones.
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgproc.hpp>

#include "roslam/common/error.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/inference/kernels.hpp"
#include "roslam/inference/plan/network_plan.hpp"
#include "roslam/inference/score_grid.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "tests/network_hash.hpp"
#include "tests/onnx_writer.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {
namespace fs = std::filesystem;

const fs::path kModels = ROSLAM_TEST_MODELS;

bool has_own() { return best_kernels() != nullptr; }

NetworkPlan planned(const OnnxWriter& writer, std::int64_t channels = 3) {
  return plan_network(read_onnx(writer.file("in", channels, "out")));
}

std::string refusal(const OnnxWriter& writer, std::int64_t channels = 3) {
  try {
    planned(writer, channels);
  } catch (const ModelError& error) {
    return error.what();
  }
  return "accepted";
}

std::string name_of(int value) { return std::string("a").append(std::to_string(value)); }

std::vector<float> ones(int count) { return std::vector<float>(static_cast<std::size_t>(count), 1.0F); }

int count(const NetworkPlan& plan, StepKind kind) {
  return static_cast<int>(
      std::count_if(plan.steps.begin(), plan.steps.end(), [&](const auto& s) { return s.kind == kind; }));
}

// An image of people and things, so that all classes and borders between them appear in the labels.
cv::Mat noisy_image(int rows, int columns) {
  cv::Mat image(rows, columns, CV_8UC3);
  cv::RNG random(5);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {}, 3.0);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  cv::rectangle(image, {columns / 4, rows / 3}, {columns / 2, rows - 1}, {60, 40, 190}, cv::FILLED);
  cv::circle(image, {columns * 3 / 8, rows / 4}, rows / 10 + 1, {140, 170, 220}, cv::FILLED);
  return image;
}

TEST(SuppliedNetworks, BecomeTheStepsThatTheKernelsHave) {
  const NetworkPlan segmenter = plan_network(read_onnx(file_content(kModels / "roslam-pspnet.onnx")));
  EXPECT_EQ(segmenter.mean.size(), 3U);
  EXPECT_EQ(segmenter.deviation.size(), 3U);
  EXPECT_EQ(segmenter.output_channels, kClasses);
  EXPECT_EQ(segmenter.sub_pixels, 2);
  EXPECT_EQ(segmenter.lanes, kScoreLanes);
  // Of 64 additions, activations and copies only three additions remain, and no copy.
  EXPECT_LE(count(segmenter, StepKind::kBinary), 3);
  EXPECT_EQ(count(segmenter, StepKind::kCopy), 0);
  EXPECT_LE(segmenter.steps.size(), 70U);
  for (const char* kind : {"person", "car", "bicycle", "unknown"}) {
    const NetworkPlan restorer =
        plan_network(read_onnx(file_content(kModels / ("roslam-restorer-" + std::string(kind) + ".onnx"))));
    EXPECT_EQ(count(restorer, StepKind::kRegionNorm), 10) << kind;
    EXPECT_EQ(restorer.output_channels, 3);
  }
}

TEST(OwnEngine, LabelsAsOpenCvDoes) {
  if (!has_own() || !has_opencv_dnn()) GTEST_SKIP() << "needs the own engine and OpenCV's dnn module";
  struct Case {
    int rows, columns, side;
  };
  for (const Case c : {Case{480, 640, 416},
                       {480, 640, 480},
                       {720, 1280, 640},
                       {333, 97, 160},
                       {20, 1000, 416},
                       {31, 33, 32},
                       {1088, 1920, 960}}) {
    const cv::Mat image = noisy_image(c.rows, c.columns);
    PspnetSegmenter own(find_segmentation_model(), {c.side}, InferenceBackend::kOwn);
    PspnetSegmenter opencv(find_segmentation_model(), {c.side}, InferenceBackend::kOpenCv);
    const Segmentation a = own.segment(image);
    const Segmentation b = opencv.segment(image);
    const double differ = cv::countNonZero(a.labels != b.labels) / static_cast<double>(image.total());
    EXPECT_LE(differ, 1e-4) << c.columns << "x" << c.rows;
    EXPECT_LT(cv::norm(a.probability, b.probability, cv::NORM_INF), 1e-3);
    for (std::size_t k = 0; k < kClasses; ++k) EXPECT_NEAR(a.confidence[k], b.confidence[k], 1e-3);
    // Again the same bytes, also with two threads.
    EXPECT_EQ(cv::norm(own.segment(image).labels, a.labels, cv::NORM_INF), 0.0);
    PspnetSegmenter two(find_segmentation_model(), {c.side, 2}, InferenceBackend::kOwn);
    EXPECT_EQ(cv::norm(two.segment(image).labels, a.labels, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(two.segment(image).probability, a.probability, cv::NORM_INF), 0.0);
  }
}

TEST(OwnEngine, InpaintsAsOpenCvDoes) {
  if (!has_own() || !has_opencv_dnn()) GTEST_SKIP() << "needs the own engine and OpenCV's dnn module";
  const int size[] = {1, 5, 256, 256};
  cv::Mat input(4, size, CV_32F, cv::Scalar(0));
  cv::Mat image;
  noisy_image(256, 256).convertTo(image, CV_32F, 1.0 / 255.0);
  for (int c = 0; c < 3; ++c) cv::extractChannel(image, cv::Mat(256, 256, CV_32F, input.ptr<float>(0, c)), c);
  cv::Mat(256, 256, CV_32F, input.ptr<float>(0, 3))(cv::Rect(90, 70, 50, 120)) = 1.0;
  cv::Mat(256, 256, CV_32F, input.ptr<float>(0, 4))(cv::Rect(60, 70, 120, 120)) = 1.0;
  for (const char* kind : {"person", "car", "bicycle", "unknown"}) {
    const fs::path file = kModels / ("roslam-restorer-" + std::string(kind) + ".onnx");
    const cv::Mat own = load_inference(file, InferenceBackend::kOwn)->run(input).clone();
    const cv::Mat opencv = load_inference(file, InferenceBackend::kOpenCv)->run(input).clone();
    EXPECT_LT(cv::norm(own.reshape(1, 1), opencv.reshape(1, 1), cv::NORM_INF), 0.5 / 255.0) << kind;
  }
}

TEST(OwnEngine, RefusesWhatIsNotAnImageOfTheNetwork) {
  if (!has_own()) GTEST_SKIP() << "this processor has no fused multiply-add";
  const auto own = load_inference(kModels / "roslam-pspnet.onnx", InferenceBackend::kOwn);
  const int grey[] = {1, 1, 64, 64};
  EXPECT_THROW(own->run(cv::Mat(4, grey, CV_32F, cv::Scalar(0))), ModelError);
  const int odd[] = {1, 3, 50, 64};
  EXPECT_THROW(own->run(cv::Mat(4, odd, CV_32F, cv::Scalar(0))), ModelError);
  EXPECT_THROW(own->run(cv::Mat(64, 64, CV_32FC3)), ModelError);
  PspnetSegmenter segmenter(find_segmentation_model(), {}, InferenceBackend::kOwn);
  EXPECT_THROW(segmenter.segment({}), InputError);
}

TEST(Lowering, JoinsWhatFollowsAConvolution) {
  OnnxWriter writer;
  writer.array("w", {3, 3, 1, 1}, ones(9))
      .array("d", {3, 1, 3, 3}, ones(27))
      .node("Conv", {"in", "d"}, "a", {{"group", {3}}, {"pads", {1, 1, 1, 1}}})
      .node("Conv", {"a", "w"}, "b")
      .node("Add", {"in", "b"}, "c")
      .node("Relu", {"c"}, "out");
  const NetworkPlan plan = planned(writer);
  ASSERT_EQ(plan.steps.size(), 1U);
  EXPECT_TRUE(plan.steps[0].depthwise);
  EXPECT_TRUE(plan.steps[0].relu);
  EXPECT_EQ(plan.steps[0].second, 0);
}

TEST(Lowering, WritesTheInputsOfAConcatenationWhereTheyAreRead) {
  OnnxWriter writer;
  writer.array("w", {4, 3, 1, 1}, ones(12))
      .array("v", {2, 8, 1, 1}, ones(16))
      .node("Conv", {"in", "w"}, "a")
      .node("Conv", {"in", "w"}, "b")
      .node("Concat", {"a", "b"}, "c", {{"axis", {1}}})
      .node("Conv", {"c", "v"}, "out");
  const NetworkPlan plan = planned(writer);
  EXPECT_EQ(plan.steps.size(), 3U);
  EXPECT_EQ(count(plan, StepKind::kCopy), 0);
}

TEST(Lowering, NamesTheLayerThatTheKernelsLack) {
  OnnxWriter writer;
  writer.array("w", {3, 3, 1, 1}, ones(9)).node("Conv", {"in", "w"}, "a").node("Softmax", {"a"}, "out");
  EXPECT_NE(refusal(writer).find("layer Softmax the_out"), std::string::npos) << refusal(writer);
  const auto conv = [&](const OnnxWriter::Integers& attributes, const std::vector<std::int64_t>& shape) {
    std::int64_t values = 1;
    for (const auto side : shape) values *= side;
    OnnxWriter one;
    one.array("w", shape, ones(static_cast<int>(values))).node("Conv", {"in", "w"}, "out", attributes);
    return refusal(one);
  };
  EXPECT_EQ(conv({}, {3, 3, 1, 1}), "accepted");
  EXPECT_NE(conv({}, {3, 3, 3, 3}), "accepted");                        // without padding
  EXPECT_NE(conv({{"pads", {2, 2, 2, 2}}}, {3, 3, 5, 5}), "accepted");  // too large
  EXPECT_NE(conv({{"pads", {1, 1, 1, 1}}, {"strides", {3, 3}}}, {3, 3, 3, 3}), "accepted");
  EXPECT_NE(conv({{"group", {3}}, {"pads", {1, 1, 1, 1}}}, {3, 1, 3, 3}), "accepted");  // depthwise alone
  EXPECT_NE(conv({}, {3, 4, 1, 1}), "accepted");                                        // of other channels
  EXPECT_NE(conv({{"group", {0}}}, {3, 3, 1, 1}), "accepted");
  EXPECT_NE(conv({{"group", {-5}}}, {3, 3, 1, 1}), "accepted");
}

TEST(Lowering, RefusesGraphsThatAreNoComputation) {
  OnnxWriter circle;
  circle.array("w", {3, 3, 1, 1}, ones(9)).node("Add", {"out", "in"}, "out");
  EXPECT_NE(refusal(circle).find("uses a value that no layer before it computes"), std::string::npos);
  OnnxWriter twice;
  twice.node("Relu", {"in"}, "a").node("Relu", {"a"}, "a").node("Relu", {"a"}, "out");
  EXPECT_NE(refusal(twice), "accepted");
  OnnxWriter elsewhere;
  elsewhere.node("Relu", {"in"}, "a");
  EXPECT_NE(refusal(elsewhere), "accepted");
  EXPECT_NE(refusal(OnnxWriter()), "accepted");
  OnnxWriter endless;  // each value is the sum of the one before with itself: 2^n terms
  endless.node("Relu", {"in"}, "a0");
  for (int i = 0; i < 200; ++i) {
    const std::string last = name_of(i);
    endless.node("Add", {last, last}, name_of(i + 1));
  }
  endless.node("Mul", {"in", "a200"}, "b").node("Add", {"b", "a200"}, "out");
  EXPECT_EQ(refusal(endless), "accepted");
  OnnxWriter many;
  many.node("Relu", {"in"}, "a0");
  for (int i = 0; i < 5000; ++i) many.node("Relu", {name_of(i)}, name_of(i + 1));
  EXPECT_NE(refusal(many), "accepted");
  OnnxWriter huge;
  huge.array("w", {1 << 20, 1 << 20, 1, 1}, {}).node("Conv", {"in", "w"}, "out");
  EXPECT_NE(refusal(huge), "accepted");
  OnnxWriter negative;
  negative.array("w", {-3, 3, 1, 1}, ones(9)).node("Conv", {"in", "w"}, "out");
  EXPECT_NE(refusal(negative), "accepted");
  OnnxWriter short_weights;
  short_weights.array("w", {3, 3, 1, 1}, ones(5)).node("Conv", {"in", "w"}, "out");
  EXPECT_NE(refusal(short_weights), "accepted");
}

TEST(Fallback, RunsWhatTheOwnEngineLacksAndSaysWhichLayer) {
  if (!has_own() || !has_opencv_dnn()) GTEST_SKIP() << "needs the own engine and OpenCV's dnn module";
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  OnnxWriter writer;
  std::vector<float> weights(19 * 3);
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>(i % 7) - 3.0F;
  writer.array("w", {19, 3, 1, 1}, weights)
      .node("Conv", {"in", "w"}, "a", {{"kernel_shape", {1, 1}}})
      .node("Softmax", {"a"}, "out", {{"axis", {1}}});
  const fs::path file = folder / "softmax.onnx";
  std::ofstream(file, std::ios::binary) << writer.file("in", 3, "out");
  const auto automatic = load_inference(file);
  EXPECT_NE(automatic->backend().find("opencv"), std::string::npos);
  EXPECT_NE(automatic->note().find("softmax.onnx"), std::string::npos) << automatic->note();
  EXPECT_NE(automatic->note().find("layer Softmax the_out"), std::string::npos) << automatic->note();
  EXPECT_EQ(automatic->note().find('\n'), std::string::npos);
  EXPECT_THROW(load_inference(file, InferenceBackend::kOwn), ModelError);
  const auto own = load_inference(kModels / "roslam-pspnet.onnx");
  EXPECT_EQ(own->backend(), "own (" + own_instruction_set() + ")");
  EXPECT_TRUE(own->note().empty());
}

TEST(Damage, IsRefusedAtAnyLengthAndAtAnyByte) {
  OnnxWriter writer;
  writer.array("w", {4, 3, 3, 3}, ones(108))
      .array("b", {4}, ones(4))
      .node("Conv", {"in", "w", "b"}, "a", {{"pads", {1, 1, 1, 1}}, {"strides", {2, 2}}})
      .node("Relu", {"a"}, "b1")
      .node("GlobalAveragePool", {"b1"}, "c")
      .node("Add", {"b1", "c"}, "out");
  const std::string whole = writer.file("in", 3, "out");
  EXPECT_NO_THROW(plan_network(read_onnx(whole)));
  for (std::size_t length = 0; length + 1 < whole.size(); ++length)
    EXPECT_THROW(plan_network(read_onnx(whole.substr(0, length))), ModelError) << length;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      try {
        NetworkPlan plan = plan_network(read_onnx(damaged));
        if (!has_own()) continue;
        NetworkRunner runner(std::move(plan), *best_kernels(), 1);
        runner.prepare(32, 32);
        runner.run();
      } catch (const ModelError&) {
      } catch (const std::bad_alloc&) {
      }
    }
  }
}

}  // namespace
}  // namespace roslam
