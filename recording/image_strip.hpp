// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace roslam::recording {

/// Keeps a sample of images spread evenly over a sequence of unknown length: when there are too many, every
/// other one is removed. wants() and add() may be called from different threads.
class ImageStrip {
 public:
  /// count: largest number of images(); up to twice as many are kept in between.
  explicit ImageStrip(std::size_t count) : count_(count) {}

  /// Whether the next image of the sequence is to be added; to be called once for each image.
  bool wants() {
    const std::size_t index = asked_++;
    if (index % stride_ != 0) return false;
    if (wanted_ == 2 * count_) {
      stride_ *= 2;
      wanted_ = count_;
      if (index % stride_ != 0) return false;
    }
    ++wanted_;
    return true;
  }

  void add(const cv::Mat& image) {
    images_.push_back(image);
    if (images_.size() <= 2 * count_) return;
    for (std::size_t i = 0; 2 * i < images_.size(); ++i) images_[i] = images_[2 * i];
    images_.resize((images_.size() + 1) / 2);
  }

  /// At most count images, evenly spread.
  std::vector<cv::Mat> images() const {
    std::vector<cv::Mat> chosen;
    const std::size_t count = std::min(count_, images_.size());
    for (std::size_t i = 0; i < count; ++i) chosen.push_back(images_[i * images_.size() / count]);
    return chosen;
  }

 private:
  std::size_t count_;
  std::size_t asked_ = 0, wanted_ = 0;
  std::size_t stride_ = 1;  // every stride-th image is wanted
  std::vector<cv::Mat> images_;
};

}  // namespace roslam::recording
