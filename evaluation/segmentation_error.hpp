// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/semantics/label_set.hpp"

namespace roslam::evaluation {

/// Errors of one class. Values without pixels are NaN.
struct ClassError {
  std::string name;
  double iou = 0.0;          ///< intersection over union of the true and the labelled pixels
  double recall = 0.0;       ///< share of the true pixels that are labelled so
  double precision = 0.0;    ///< share of the pixels labelled so that are true
  std::uint64_t pixels = 0;  ///< true pixels
};

struct SegmentationError {
  std::vector<ClassError> classes;
  double mean_iou = 0.0;        ///< over the classes that occur in truth or labels
  double pixel_accuracy = 0.0;  ///< share of the pixels of known truth that are labelled correctly
  std::size_t images = 0;
};

/// Confusion matrix over any number of images.
class Confusion {
 public:
  /// names: of the classes; label images hold indices into them.
  explicit Confusion(std::vector<std::string> names);

  /// Both CV_8UC1 of one size. Pixels whose truth is no index are ignored; a label that is no index is wrong.
  /// Throws InputError if sizes or types differ.
  void add(const cv::Mat& truth, const cv::Mat& labels);

  SegmentationError error() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::uint64_t> counts_;  // truth by row; the last column holds labels that are no index
  std::size_t images_ = 0;
};

/// Compares a folder of label images with one of true labels of the same file names. Either folder may hold
/// the images in a subfolder labels. The label set of a folder is, in this order, the one given by name, that
/// of a labels.json as `roslam segment` writes it, or inferred from the values: if some cannot occur in
/// `set`, the 19 Cityscapes classes. For the set person, any value but 0 is a person. Throws InputError
/// naming what is missing or does not fit.
SegmentationError evaluate_segmentation(const std::filesystem::path& truth,
                                        const std::filesystem::path& estimate, const LabelSet& set,
                                        const std::string& truth_set = "",
                                        const std::string& estimate_set = "");

/// A Markdown table that also reads well as plain text, and one JSON object (null where there is no value).
std::string to_markdown(const SegmentationError& error);
std::string to_json(const SegmentationError& error, const std::string& set);

}  // namespace roslam::evaluation
