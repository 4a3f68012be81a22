// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "evaluation/segmentation_error.hpp"
#include "roslam/common/error.hpp"
#include "tests/scratch.hpp"

namespace roslam {

using namespace evaluation;
namespace {

namespace fs = std::filesystem;
using Labels = cv::Mat_<std::uint8_t>;

// Folders of label images that vanish with the test.
class SegmentationFolders : public testing::Test {
 protected:
  SegmentationFolders() : folder_(scratch_path()) {}
  ~SegmentationFolders() override { fs::remove_all(folder_); }

  fs::path put(const std::string& folder, const std::string& name, const cv::Mat& labels) {
    fs::create_directories(folder_ / folder);
    cv::imwrite((folder_ / folder / (name + ".png")).string(), labels);
    return folder_ / folder;
  }

  static double iou(const SegmentationError& error, const std::string& name) {
    for (const auto& c : error.classes) {
      if (c.name == name) return c.iou;
    }
    return -1.0;
  }

  fs::path folder_;
};

TEST(Confusion, CountsByHand) {
  Confusion confusion({"a", "b", "c"});
  // truth a a a b b void; labels a a b b (no class) a
  confusion.add((Labels(1, 6) << 0, 0, 0, 1, 1, 255), (Labels(1, 6) << 0, 0, 1, 1, 9, 0));
  const SegmentationError error = confusion.error();
  EXPECT_DOUBLE_EQ(error.classes[0].iou, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(error.classes[0].recall, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(error.classes[0].precision, 1.0);
  EXPECT_DOUBLE_EQ(error.classes[1].iou, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(error.classes[1].precision, 0.5);
  EXPECT_TRUE(std::isnan(error.classes[2].iou));  // occurs nowhere: no part of the mean
  EXPECT_DOUBLE_EQ(error.mean_iou, 0.5);
  EXPECT_DOUBLE_EQ(error.pixel_accuracy, 3.0 / 5.0);
  EXPECT_EQ(error.classes[0].pixels, 3U);
}

TEST(Confusion, RefusesImagesThatDoNotFit) {
  Confusion confusion({"a"});
  EXPECT_THROW(confusion.add(Labels(2, 2, std::uint8_t{0}), Labels(2, 3, std::uint8_t{0})), InputError);
  EXPECT_THROW(confusion.add(Labels(2, 2, std::uint8_t{0}), cv::Mat(2, 2, CV_16UC1)), InputError);
}

TEST_F(SegmentationFolders, GroupsLabelsOfNineteenClassesByThemselves) {
  const auto truth = put("truth/labels", "x", (Labels(1, 4) << 0, 11, 13, 255)).parent_path();
  const auto fine = put("fine", "x", (Labels(1, 4) << 1, 12, 17, 0));  // the same groups, other classes
  const auto grouped = put("grouped", "x", (Labels(1, 4) << 0, 5, 6, 0));
  for (const auto& estimate : {fine, grouped}) {
    const auto error = evaluate_segmentation(truth, estimate, *label_set_from("groups8"));
    EXPECT_DOUBLE_EQ(error.mean_iou, 1.0) << estimate;
    EXPECT_EQ(error.classes.size(), 8U);
  }
  EXPECT_DOUBLE_EQ(evaluate_segmentation(truth, fine, *label_set_from("cityscapes19")).mean_iou, 0.0);
}

TEST_F(SegmentationFolders, BelievesLabelsJson) {
  const auto truth = put("truth", "x", (Labels(1, 2) << 3, 9));     // CamVid: road, pedestrian
  const auto labels = put("labels", "x", (Labels(1, 2) << 0, 11));  // Cityscapes: road, person
  // By value alone these could be CamVid's sky and void.
  EXPECT_DOUBLE_EQ(evaluate_segmentation(truth, labels, *label_set_from("camvid11")).mean_iou, 0.0);
  std::ofstream(labels / "labels.json") << R"({"classes": "cityscapes19"})";
  EXPECT_DOUBLE_EQ(evaluate_segmentation(truth, labels, *label_set_from("camvid11")).mean_iou, 1.0);
  std::ofstream(labels / "labels.json") << "nonsense";
  EXPECT_THROW(evaluate_segmentation(truth, labels, *label_set_from("camvid11")), InputError);
}

TEST_F(SegmentationFolders, TakesAnyActorForAPerson) {
  const auto truth = put("truth", "x", (Labels(1, 4) << 0, 1, 2, 255));
  const auto labels = put("labels", "x", (Labels(1, 4) << 0, 255, 255, 0));
  const auto error = evaluate_segmentation(truth, labels, *label_set_from("person"));
  EXPECT_DOUBLE_EQ(iou(error, "person"), 2.0 / 3.0);
  const auto fine = put("fine", "x", (Labels(1, 4) << 0, 11, 12, 13));
  EXPECT_DOUBLE_EQ(
      iou(evaluate_segmentation(truth, fine, *label_set_from("person"), "", "cityscapes19"), "person"),
      2.0 / 3.0);
}

TEST_F(SegmentationFolders, NamesWhatIsMissingOrDoesNotFit) {
  const auto truth = put("truth", "a", Labels(2, 2, std::uint8_t{0}));
  put("truth", "b", Labels(2, 2, std::uint8_t{0}));
  const auto labels = put("labels", "a", Labels(2, 2, std::uint8_t{0}));
  const auto reason = [&] {
    try {
      evaluate_segmentation(truth, labels, *label_set_from("cityscapes19"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(reason().find("b.png: missing"), std::string::npos) << reason();
  put("labels", "b", Labels(2, 3, std::uint8_t{0}));
  EXPECT_NE(reason().find("b.png: labels are 3x2 pixels, the truth 2x2"), std::string::npos) << reason();
  put("labels", "b", cv::Mat(2, 2, CV_8UC3, cv::Scalar(0, 0, 0)));
  EXPECT_NE(reason().find("b.png: is not an 8-bit grey image"), std::string::npos) << reason();
  EXPECT_THROW(evaluate_segmentation(folder_ / "none", labels, *label_set_from("person")), InputError);
  EXPECT_THROW(evaluate_segmentation(truth, truth, *label_set_from("groups8"), "camvid11"), InputError);
}

TEST(SegmentationReport, SaysNullWhereThereIsNoValue) {
  Confusion confusion({"a", "b"});
  confusion.add((Labels(1, 1) << 0), (Labels(1, 1) << 0));
  EXPECT_NE(to_json(confusion.error(), "test").find(R"("b":{"iou":null)"), std::string::npos);
  EXPECT_NE(to_markdown(confusion.error()).find("Mean IoU 1.0000"), std::string::npos);
}

}  // namespace
}  // namespace roslam
