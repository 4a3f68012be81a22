// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/degraded_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace roslam::simulation {

namespace {
constexpr std::array<std::pair<std::string_view, Degradation>, 8> kNames{
    {{"none", Degradation::kNone},
     {"every-2", Degradation::kEvery2},
     {"every-3", Degradation::kEvery3},
     {"every-4", Degradation::kEvery4},
     {"every-5", Degradation::kEvery5},
     {"blur", Degradation::kBlur},
     {"exposure", Degradation::kExposure},
     {"bursts", Degradation::kBursts}}};

// Of the images, one is kept.
std::size_t interval_of(Degradation degradation) {
  switch (degradation) {
    case Degradation::kEvery2:
      return 2;
    case Degradation::kEvery3:
      return 3;
    case Degradation::kEvery4:
      return 4;
    case Degradation::kEvery5:
      return 5;
    default:
      return 1;
  }
}

// Along a line whose direction changes from one blurred stretch to the next.
cv::Mat blurred(const cv::Mat& image, std::size_t index) {
  constexpr std::size_t kStretch = 5;  // images; of three stretches one is blurred
  if (index / kStretch % 3 != 0) return image;
  const int length = std::max(3, image.cols / 40 | 1);
  const double angle = 0.7 * static_cast<double>(index / kStretch);  // radians
  cv::Mat kernel = cv::Mat::zeros(length, length, CV_32FC1);
  const cv::Point2d centre(0.5 * (length - 1), 0.5 * (length - 1));
  const cv::Point2d half = centre.x * cv::Point2d(std::cos(angle), std::sin(angle));
  cv::line(kernel, centre - half, centre + half, 1.0);
  kernel /= cv::sum(kernel)[0];
  cv::Mat result;
  cv::filter2D(image, result, -1, kernel);
  return result;
}

cv::Mat exposed(const cv::Mat& image, std::size_t index) {
  constexpr std::size_t kStretch = 20;  // images
  constexpr std::array<double, 5> kGains{1.0, 0.5, 1.6, 0.7, 1.2};
  cv::Mat result;
  image.convertTo(result, -1, kGains.at(index / kStretch % kGains.size()));
  return result;
}
}  // namespace

std::string_view name_of(Degradation degradation) {
  for (const auto& [name, value] : kNames) {
    if (value == degradation) return name;
  }
  return "none";
}

std::optional<Degradation> degradation_from(std::string_view name) {
  for (const auto& [known, value] : kNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> degradation_names() {
  std::vector<std::string> names;
  for (const auto& [name, value] : kNames) names.emplace_back(name);
  return names;
}

std::optional<std::size_t> DegradedSource::size() const {
  const auto all = source_->size();
  if (!all || degradation_ == Degradation::kBursts)
    return std::nullopt;  // unknown before the images are read
  const std::size_t interval = interval_of(degradation_);
  return (*all + interval - 1) / interval;
}

bool DegradedSource::is_missing(const Frame& frame) {
  if (frame.index % interval_of(degradation_) != 0) return true;
  if (degradation_ != Degradation::kBursts) return false;
  constexpr double kEvery = 3.0;  // seconds
  constexpr std::array<double, 3> kLengths{0.2, 0.5, 1.0};
  if (!begin_) begin_ = frame.timestamp;
  const double since = frame.timestamp - *begin_;
  const auto number = static_cast<std::size_t>(std::max(0.0, since / kEvery));
  // At the end of each interval, so that the start of a map is complete.
  const double left = kEvery * static_cast<double>(number + 1) - since;
  return left < kLengths.at(number % kLengths.size());
}

std::optional<Frame> DegradedSource::next() {
  while (auto frame = source_->next()) {
    if (is_missing(*frame)) continue;
    if (degradation_ == Degradation::kBlur) frame->colour = blurred(frame->colour, frame->index);
    if (degradation_ == Degradation::kExposure) frame->colour = exposed(frame->colour, frame->index);
    return frame;
  }
  return std::nullopt;
}

}  // namespace roslam::simulation
