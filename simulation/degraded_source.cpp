// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/degraded_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace roslam::simulation {

namespace {
struct Kind {
  std::string_view name;
  Degradation degradation;
  std::size_t interval;  // of so many images, one is kept
};

constexpr std::array<Kind, 8> kKinds{{{"none", Degradation::kNone, 1},
                                      {"every-2", Degradation::kEvery2, 2},
                                      {"every-3", Degradation::kEvery3, 3},
                                      {"every-4", Degradation::kEvery4, 4},
                                      {"every-5", Degradation::kEvery5, 5},
                                      {"blur", Degradation::kBlur, 1},
                                      {"exposure", Degradation::kExposure, 1},
                                      {"bursts", Degradation::kBursts, 1}}};

const Kind& kind_of(Degradation degradation) {
  return *std::find_if(kKinds.begin(), kKinds.end(),
                       [&](const Kind& kind) { return kind.degradation == degradation; });
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

std::string_view name_of(Degradation degradation) { return kind_of(degradation).name; }

std::optional<Degradation> degradation_from(std::string_view name) {
  for (const Kind& kind : kKinds) {
    if (kind.name == name) return kind.degradation;
  }
  return std::nullopt;
}

std::vector<std::string> degradation_names() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

std::optional<std::size_t> DegradedSource::size() const {
  const auto all = source().size();
  if (!all || degradation_ == Degradation::kBursts)
    return std::nullopt;  // unknown before the images are read
  const std::size_t interval = kind_of(degradation_).interval;
  return (*all + interval - 1) / interval;
}

bool DegradedSource::is_missing(const Frame& frame) {
  if (frame.index % kind_of(degradation_).interval != 0) return true;
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
  std::vector<InertialSample> inertial;  // of missing frames
  while (auto frame = source().next()) {
    prepend_samples(std::move(inertial), frame->inertial);
    inertial.clear();
    if (is_missing(*frame)) {
      inertial = std::move(frame->inertial);
      continue;
    }
    for (cv::Mat* image : {&frame->colour, &frame->right}) {
      if (image->empty()) continue;
      if (degradation_ == Degradation::kBlur) *image = blurred(*image, frame->index);
      if (degradation_ == Degradation::kExposure) *image = exposed(*image, frame->index);
    }
    return frame;
  }
  return std::nullopt;
}

}  // namespace roslam::simulation
