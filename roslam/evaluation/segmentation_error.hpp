// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/semantics/label_set.hpp"

namespace roslam {

/// How well one class was found. Values are NaN where there is nothing to divide by.
struct ClassError {
  std::string name;
  double iou = 0.0;          ///< intersection over union of the true and the labelled pixels
  double recall = 0.0;       ///< share of the true pixels that were labelled so
  double precision = 0.0;    ///< share of the labelled pixels that are truly so
  std::uint64_t pixels = 0;  ///< true pixels
};

struct SegmentationError {
  std::vector<ClassError> classes;
  double mean_iou = 0.0;        ///< over the classes that occur in truth or labels
  double pixel_accuracy = 0.0;  ///< share of the known pixels that are labelled right
  std::size_t pictures = 0;
};

/// Counts which class was taken for which, over any number of pictures.
class Confusion {
 public:
  /// names: of the classes, whose positions the label images hold.
  explicit Confusion(std::vector<std::string> names);

  /// Both CV_8UC1 of one size. Where truth is no position the pixel is left out; a label that is no position
  /// is wrong. Throws InputError if sizes or types differ.
  void add(const cv::Mat& truth, const cv::Mat& labels);

  SegmentationError error() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::uint64_t> counts_;  // truth by row; the last column holds labels that are no position
  std::size_t pictures_ = 0;
};

/// Scores a folder of label images against one of true labels of the same file names. Either folder may hold
/// the images in a subfolder labels. What the values in a folder mean is told, in this order, by the given
/// name of a label set, by a labels.json as `roslam segment` writes it, or by the values: those no image of
/// `set` can have are taken for the 19 Cityscapes classes. For the set person, any value but 0 is a person.
/// Throws InputError naming what is missing or does not fit.
SegmentationError evaluate_segmentation(const std::filesystem::path& truth,
                                        const std::filesystem::path& estimate, const LabelSet& set,
                                        const std::string& truth_set = "",
                                        const std::string& estimate_set = "");

/// A Markdown table that also reads well as plain text, and one JSON object (null where there is no value).
std::string to_markdown(const SegmentationError& error);
std::string to_json(const SegmentationError& error, const std::string& set);

}  // namespace roslam
