// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace roslam {

/// Keeps pictures spread over a sequence whose length nobody knows: when there are too many, every other one
/// goes. wants() may be asked on another thread than add() is called on.
class PictureStrip {
 public:
  /// count: pictures in the end; twice as many are kept until then.
  explicit PictureStrip(std::size_t count) : count_(count) {}

  /// Asked once for each picture of the sequence: whether it is to be added.
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

  void add(const cv::Mat& picture) {
    pictures_.push_back(picture);
    if (pictures_.size() <= 2 * count_) return;
    for (std::size_t i = 0; 2 * i < pictures_.size(); ++i) pictures_[i] = pictures_[2 * i];
    pictures_.resize((pictures_.size() + 1) / 2);
  }

  /// At most so many as were to be in the end.
  std::vector<cv::Mat> pictures() const {
    std::vector<cv::Mat> chosen;
    const std::size_t count = std::min(count_, pictures_.size());
    for (std::size_t i = 0; i < count; ++i) chosen.push_back(pictures_[i * pictures_.size() / count]);
    return chosen;
  }

 private:
  std::size_t count_;
  std::size_t asked_ = 0, wanted_ = 0;
  std::size_t stride_ = 1;  // every so many one is wanted
  std::vector<cv::Mat> pictures_;
};

}  // namespace roslam
