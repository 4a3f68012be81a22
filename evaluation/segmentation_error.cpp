// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/segmentation_error.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
double ratio(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? std::numeric_limits<double>::quiet_NaN()
                    : static_cast<double>(part) / static_cast<double>(whole);
}
}  // namespace

Confusion::Confusion(std::vector<std::string> names)
    : names_(std::move(names)), counts_(names_.size() * (names_.size() + 1), 0) {}

void Confusion::add(const cv::Mat& truth, const cv::Mat& labels) {
  if (truth.type() != CV_8UC1 || labels.type() != CV_8UC1)
    throw InputError("labels must be 8-bit grey images");
  if (truth.size() != labels.size()) {
    throw InputError("labels are " + std::to_string(labels.cols) + "x" + std::to_string(labels.rows) +
                     " pixels, the truth " + std::to_string(truth.cols) + "x" + std::to_string(truth.rows));
  }
  const std::size_t classes = names_.size();
  for (int y = 0; y < truth.rows; ++y) {
    const auto* true_row = truth.ptr<std::uint8_t>(y);
    const auto* row = labels.ptr<std::uint8_t>(y);
    for (int x = 0; x < truth.cols; ++x) {
      if (true_row[x] >= classes) continue;
      ++counts_[true_row[x] * (classes + 1) + std::min<std::size_t>(row[x], classes)];
    }
  }
  ++images_;
}

SegmentationError Confusion::error() const {
  const std::size_t classes = names_.size();
  SegmentationError result;
  result.images = images_;
  std::uint64_t right = 0;
  std::uint64_t known = 0;
  double sum = 0.0;
  std::size_t occurring = 0;
  for (std::size_t c = 0; c < classes; ++c) {
    std::uint64_t truth = 0;
    std::uint64_t labelled = 0;
    for (std::size_t other = 0; other <= classes; ++other) truth += counts_[c * (classes + 1) + other];
    for (std::size_t other = 0; other < classes; ++other) labelled += counts_[other * (classes + 1) + c];
    const std::uint64_t hits = counts_[c * (classes + 1) + c];
    const ClassError error{names_[c], ratio(hits, truth + labelled - hits), ratio(hits, truth),
                           ratio(hits, labelled), truth};
    if (std::isfinite(error.iou)) {
      sum += error.iou;
      ++occurring;
    }
    right += hits;
    known += truth;
    result.classes.push_back(error);
  }
  result.mean_iou =
      occurring > 0 ? sum / static_cast<double>(occurring) : std::numeric_limits<double>::quiet_NaN();
  result.pixel_accuracy = ratio(right, known);
  return result;
}

}  // namespace roslam::evaluation
