// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/removal_error.hpp"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/dynamic_objects/mask_refinement.hpp"

namespace roslam::evaluation {

namespace {
enum Region : std::uint8_t { kBeyond, kNear, kAtRest, kActor };

template <typename Count>
double ratio(Count part, Count whole) {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(part) / static_cast<double>(whole);
}

void require_mask(const cv::Mat& mask, const cv::Mat& grey, bool may_be_empty, const char* name) {
  if (mask.empty() && may_be_empty) return;
  if (mask.type() != CV_8UC1 || mask.size() != grey.size()) {
    throw InputError(std::string(name) + " must be an 8-bit grey image of the size of the frame");
  }
}

// The Region of each pixel, CV_8UC1.
cv::Mat regions_of(const MovingTruth& truth) {
  cv::Mat regions = cv::Mat::zeros(truth.actors.size(), CV_8UC1);
  if (cv::countNonZero(truth.actors) > 0) {
    cv::Mat distance;
    cv::distanceTransform(truth.actors == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    regions.setTo(kNear, distance <= static_cast<double>(kNearActor));
  }
  if (!truth.at_rest.empty()) regions.setTo(kAtRest, truth.at_rest);
  regions.setTo(kActor, truth.actors);
  return regions;
}

PointTally& tally_of(RemovalError& error, std::uint8_t region) {
  switch (region) {
    case kActor:
      return error.on_actors;
    case kAtRest:
      return error.at_rest;
    case kNear:
      return error.near_actors;
    default:
      return error.beyond;
  }
}

std::uint8_t value_at(const cv::Mat& image, const cv::Point2f& point) {
  const int x = std::clamp(cvRound(point.x), 0, image.cols - 1);
  const int y = std::clamp(cvRound(point.y), 0, image.rows - 1);
  return image.at<std::uint8_t>(y, x);
}
}  // namespace

double PointTally::kept_share() const { return ratio(kept, kept + removed); }
double PointTally::removed_share() const { return ratio(removed, kept + removed); }

PointTally& PointTally::operator+=(const PointTally& other) {
  kept += other.kept;
  removed += other.removed;
  return *this;
}

PointTally RemovalError::on_static_scene() const {
  PointTally both = near_actors;
  return both += beyond;
}

double RemovalError::run_actor_share() const { return ratio(run_points_on_actors, run_points); }
double RemovalError::actor_share() const { return ratio(actor_pixels, pixels); }
double RemovalError::removed_share() const { return ratio(removed_pixels, pixels); }
double RemovalError::actor_recall() const { return ratio(removed_actor_pixels, actor_pixels); }

// The features of a frame with a mask, and the corners that it removes.
struct RemovalComparison::Extraction {
  cv::Mat mask;
  std::vector<OrbFeature> kept;
  std::vector<cv::Point2f> removed;

  // whole: the dilated mask of all that was removed.
  CountedPoints counted(const cv::Mat& whole) const {
    const auto is_beside = [&](const cv::Point2f& point) { return value_at(whole, point) == 0; };
    const auto beside = std::count_if(removed.begin(), removed.end(), is_beside);
    return {kept.size(), removed.size(), static_cast<std::size_t>(beside)};
  }
};

RemovalComparison::RemovalComparison(const OrbOptions& orb, int margin) : extractor_(orb), margin_(margin) {
  if (margin < 0) throw OptionsError("dynamic_objects.margin must not be negative");
}

RemovalComparison::Extraction RemovalComparison::extract(const cv::Mat& grey, const cv::Mat& mask) const {
  Extraction points{mask, {}, {}};
  points.kept = extractor_.extract(grey, mask, &points.removed);
  return points;
}

RemovalComparison::Extraction RemovalComparison::extract_as_run(const cv::Mat& grey,
                                                                const RemovedThings& run) {
  const cv::Mat mask = run.mask.empty() ? cv::Mat() : dilated(run.mask != 0, margin_);
  Extraction points = extract(grey, mask);
  if (!run.points || points.counted(mask) == *run.points) return points;
  if (!mask.empty() && !run.resting.empty()) {
    Extraction lenient = extract(grey, mask & ~dilated_apart(run.resting != 0, run.mask != 0, margin_));
    if (lenient.counted(mask) == *run.points) return lenient;
  }
  ++error_.unlike_run;
  if (!mask.empty()) ++error_.unlike_with_mask;
  return points;
}

void RemovalComparison::add(const cv::Mat& grey, const MovingTruth& truth, const RemovedThings& run) {
  require_mask(truth.actors, grey, false, "the mask of actors");
  require_mask(truth.at_rest, grey, true, "the mask of objects at rest");
  require_mask(run.mask, grey, true, "the mask of a run");
  require_mask(run.resting, grey, true, "the mask of objects at rest of a run");
  const Extraction points = extract_as_run(grey, run);
  const bool is_masked = !points.mask.empty();
  const cv::Mat forbidden = is_masked ? extractor_.forbidden(points.mask) : cv::Mat();
  const cv::Mat regions = regions_of(truth);
  for (const auto& feature : is_masked ? extractor_.extract(grey) : points.kept) {
    PointTally& tally = tally_of(error_, value_at(regions, feature.pixel));
    ++(is_masked && value_at(forbidden, feature.pixel) != 0 ? tally.removed : tally.kept);
  }
  error_.run_points += points.kept.size();
  for (const auto& feature : points.kept) {
    if (value_at(regions, feature.pixel) == kActor) ++error_.run_points_on_actors;
  }
  const auto count = [](const cv::Mat& mask) { return static_cast<std::uint64_t>(cv::countNonZero(mask)); };
  error_.pixels += grey.total();
  error_.actor_pixels += count(truth.actors);
  if (is_masked) {
    ++error_.with_mask;
    error_.removed_pixels += count(points.mask);
    error_.removed_actor_pixels += count(points.mask & (truth.actors != 0));
  }
  ++error_.frames;
}

}  // namespace roslam::evaluation
