// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/front_end.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/common/stopwatch.hpp"
#include "roslam/options/settings.hpp"
#include "roslam/sensors/counts.hpp"

namespace roslam {

FrontEnd::FrontEnd(const Camera& camera, const Options& options, Mode mode,
                   std::shared_ptr<Segmenter> segmenter, const LoadControl* load)
    : camera_(camera),
      options_(options),
      mode_(mode),
      load_(load),
      depth_check_(camera.fx),
      noise_(camera, options.noise),
      segmentation_(options.dynamic_objects.labels ? std::move(segmenter) : nullptr, mode, options.threads),
      detector_(camera, detector_settings(options)),
      extractor_(options.orb) {
  if (camera.is_stereo()) stereo_.emplace(camera, options.stereo);
}

bool FrontEnd::detects() const { return segmentation_.is_on() || needs_depth(); }

bool FrontEnd::needs_depth() const {
  return options_.dynamic_objects.depth_consistency || options_.dynamic_objects.flow;
}

FrontEndResult FrontEnd::observe(const Frame& frame, const cv::Mat& mask,
                                 const std::optional<SE3>& predicted_T_camera_world,
                                 std::size_t frame_count) {
  const Stopwatch watch;
  FrontEndResult result;
  cv::Mat grey;
  cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
  brightness_.update(grey);
  grey = brightness_.apply(grey);
  check_input(frame, grey, result);
  depth_ = frame.depth;
  if (detects()) result.dynamic_objects = detect(frame, grey, predicted_T_camera_world, frame_count);
  result.detection_seconds = watch.seconds();
  extract(frame, grey, mask, frame_count, result);
  const cv::Mat& hidden = result.dynamic_objects.mask;
  if (!hidden.empty()) result.hidden_share = cv::countNonZero(hidden) / static_cast<double>(hidden.total());
  result.may_start = !fills_image(frame, result);
  result.extraction_seconds = watch.seconds() - result.detection_seconds;
  return result;
}

// Whether movable objects fill the image, also where the labels of all of it were not used.
bool FrontEnd::fills_image(const Frame& frame, const FrontEndResult& observation) {
  if (observation.hidden_share >= options_.tracker.hidden_share &&
      observation.removed_points.size() > observation.points.size())
    return true;
  constexpr double kLongestWait = 0.5;  // seconds for the first labels, in real time
  if (!first_timestamp_) first_timestamp_ = frame.timestamp;
  const bool awaits_labels = mode_ == Mode::kRealTime && segmentation_.is_on() &&
                             frame.timestamp - *first_timestamp_ < kLongestWait &&
                             observation.dynamic_objects.label_age < 0 && faults().empty();
  if (awaits_labels) return true;
  if (!observation.dynamic_objects.is_everything_labelled || frame.depth.empty()) return false;
  // What fills nine tenths of the image is near, if it is a person or a car; else the labels are wrong.
  constexpr double kNear = 3.0;  // metres
  const cv::Mat near = (frame.depth > 0.0F) & (frame.depth < kNear);
  return 2 * cv::countNonZero(near) > cv::countNonZero(frame.depth > 0.0F);
}

void FrontEnd::check_input(const Frame& frame, const cv::Mat& grey, FrontEndResult& observation) {
  if (frame.right.empty() || !stereo_) depth_check_.add(grey, frame.depth, frame.timestamp);
  const auto all = warnings();
  for (const auto& [warning, frames] : all) {
    if (warned_.insert(warning).second) observation.warnings.push_back(warning);
  }
}

DynamicObjects FrontEnd::detect(const Frame& frame, const cv::Mat& grey,
                                const std::optional<SE3>& predicted_T_camera_world, std::size_t frame_count) {
  const auto is_taken = [&](LoadMeasure measure) { return load_ != nullptr && load_->is_taken(measure); };
  auto every = static_cast<std::size_t>(options_.dynamic_objects.label_every);
  if (mode_ == Mode::kRealTime) every = is_taken(LoadMeasure::kLabelsEverySecond) ? 2 : 1;
  const bool examine_geometry = !is_taken(LoadMeasure::kGeometryEverySecond) || frame_count % 2 == 0;
  if (frame_count % every == 0) segmentation_.offer(frame.index, brightness_.apply(frame.colour));
  const auto labels = segmentation_.take();
  DynamicObjects objects = detector_.detect(frame, grey, predicted_T_camera_world, labels, examine_geometry);
  // Labels that the detector rejected are not for the dense map either.
  if (labels && objects.label_age == static_cast<int>(frame.index - labels->index)) {
    labelled_index_ = labels->index;
    labels_ = labels->segmentation.labels;
  }
  return objects;
}

void FrontEnd::extract(const Frame& frame, const cv::Mat& grey, const cv::Mat& mask, std::size_t frame_count,
                       FrontEndResult& result) {
  const DynamicObjects& objects = result.dynamic_objects;
  // Where few static points are left, those on objects that rested for long count like them. What shows no
  // motion now serves the pose.
  const bool is_scarce = frame_count > 0 && last_inliers_ < options_.dynamic_objects.scarce_points;
  const cv::Mat resting = is_scarce ? objects.resting : cv::Mat();
  cv::Mat still = objects.still;
  cv::Mat forbidden = objects.mask;
  if (!resting.empty()) forbidden = forbidden & ~resting;
  if (!mask.empty()) {
    forbidden = forbidden.empty() ? mask : cv::Mat(forbidden | mask);
    if (!still.empty()) still = still & ~(mask != 0);
  }
  const std::vector<cv::Mat> pyramid = extractor_.pyramid(grey);
  auto features = extractor_.extract(pyramid, forbidden, still, &result.removed_points);
  // Beyond the part of the image that the lens model covers.
  std::erase_if(features, [&](const OrbFeature& feature) {
    return !camera_.try_undistort(Eigen::Vector2d(feature.pixel.x, feature.pixel.y));
  });
  for (const auto& feature : features) {
    if (!feature.is_in_part) result.points.push_back(feature.pixel);
  }
  const bool is_pair = stereo_ && !frame.right.empty();
  auto view = std::make_shared<ObservedFrame>(
      roslam::observe(features, frame.colour, is_pair ? cv::Mat() : frame.depth, camera_, options_.depth));
  if (is_pair) {
    const auto right = extractor_.pyramid(brightness_.apply(frame.right));
    stereo_->set_depths(stereo_->match(features, pyramid, right), *view);
  }
  if (!resting.empty() || !still.empty()) {
    for (const auto& feature : features) {
      const cv::Point pixel(std::min(cvRound(feature.pixel.x), grey.cols - 1),
                            std::min(cvRound(feature.pixel.y), grey.rows - 1));
      const bool has_rested = !feature.is_in_part && !resting.empty() && resting.at<std::uint8_t>(pixel) != 0;
      view->is_movable.push_back(feature.is_in_part || has_rested);
      result.rested.push_back(has_rested ? 1 : 0);
    }
  }
  noise_.note_in(*view);
  result.view = std::move(view);
}

bool FrontEnd::follow_corrections(const Map& map, const std::optional<SE3>& tracked_T_camera_world) {
  if (map_revision_ == map.corrections()) return false;
  map_revision_ = map.corrections();
  if (tracked_T_camera_world && measured_T_camera_world_) {
    detector_.apply_correction(tracked_T_camera_world->inverse() * *measured_T_camera_world_);
    measured_T_camera_world_ = tracked_T_camera_world;
  }
  noise_.interrupt();
  return true;
}

void FrontEnd::remember(const TrackedFrame& frame, const Map& map, const FrontEndResult& observation,
                        bool is_keyframe) {
  last_inliers_ = frame.inliers;
  depth_check_.note_tracking(frame.T_camera_world.has_value(), is_keyframe);
  const bool is_measured = frame.state == TrackingState::kTracking;
  // Only a measured pose is one that the map can be asked for again after it was corrected.
  if (is_measured) measured_T_camera_world_ = frame.T_camera_world;
  if (frame.T_camera_world) {
    const bool is_other_submap =
        last_reference_.is_valid() &&
        (!frame.reference.is_valid() || map.submap_of(frame.reference) != map.submap_of(last_reference_));
    if (is_other_submap) forget_poses();
    last_reference_ = frame.reference;
  }
  noise_.add(frame, depth_, observation.dynamic_objects.mask);
  if (const auto depth_noise = noise_.depth()) detector_.set_depth_noise(*depth_noise);
  if (detects())
    detector_.remember(is_measured ? frame.T_camera_world : std::nullopt, observation.points,
                       observation.removed_points);
}

void FrontEnd::forget_poses() {
  detector_.leave_submap();
  noise_.interrupt();
}

void FrontEnd::reset() {
  detector_.reset();
  depth_check_.restart_clock();
  noise_.interrupt();
  labels_.release();
}

std::vector<float> FrontEnd::level_scales() const {
  std::vector<float> scales;
  for (int level = 0; level < extractor_.levels(); ++level) scales.push_back(extractor_.scale(level));
  return scales;
}

std::map<std::string, std::size_t> FrontEnd::faults() const {
  auto faults = sum(segmentation_.faults(), detector_.faults());
  if (detector_.flickers() > 0) faults["labels come and go"] += detector_.flickers();
  return faults;
}

std::map<std::string, std::size_t> FrontEnd::warnings() const {
  auto warnings = brightness_.warnings();
  for (const std::string& alarm : depth_check_.alarms()) warnings[alarm] = 1;
  if (!camera_.has_central_principal_point())
    warnings["the principal point is far from the image centre; is the calibration of another image size?"] =
        1;
  return warnings;
}

}  // namespace roslam
