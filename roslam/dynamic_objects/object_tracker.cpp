// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/object_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMinFlowPoints = 4;
constexpr double kMinOverlap = 0.3;      // of two masks of one object
constexpr double kKeepUnlabelled = 0.3;  // seconds that an unlabelled object is kept without evidence
constexpr double kKeepUncertain = 0.05;  // seconds that an object of low confidence is kept if labels miss it
constexpr float kDecay = 0.97F;          // of the confidence, per label

bool covers(const MovableObject& object, const cv::Point2f& point) {
  const cv::Point pixel(static_cast<int>(point.x), static_cast<int>(point.y));
  return object.box.contains(pixel) && object.mask.at<std::uint8_t>(pixel - object.box.tl()) != 0;
}

// Similarity transform of the matches (RANSAC); the median translation if that fails.
cv::Matx23d similarity(const std::vector<cv::Point2f>& from, const std::vector<cv::Point2f>& to) {
  constexpr double kMaxError = 3.0;  // pixels
  const cv::Mat found =
      cv::estimateAffinePartial2D(from, to, cv::noArray(), cv::RANSAC, kMaxError, 200, 0.99);
  if (!found.empty()) {
    cv::Matx23d motion(found);
    const double scale = std::hypot(motion(0, 0), motion(1, 0));
    constexpr double kMaxChange = 1.3;  // of size, from frame to frame
    if (scale < kMaxChange && scale > 1.0 / kMaxChange) return motion;
  }
  std::vector<float> dx;
  std::vector<float> dy;
  for (std::size_t i = 0; i < from.size(); ++i) {
    dx.push_back(to[i].x - from[i].x);
    dy.push_back(to[i].y - from[i].y);
  }
  return {1.0, 0.0, upper_median(dx), 0.0, 1.0, upper_median(dy)};
}

// The apparent translation of a static object at the object's depth.
cv::Matx23d camera_motion(const MovableObject& object, const PastFrame& from, const PastFrame& to,
                          const FlowConsistency& flow) {
  const cv::Point2f centre(static_cast<float>(object.box.x) + 0.5F * static_cast<float>(object.box.width),
                           static_cast<float>(object.box.y) + 0.5F * static_cast<float>(object.box.height));
  const cv::Point2f now = flow.expected(from, to, centre);
  return {1.0, 0.0, now.x - centre.x, 0.0, 1.0, now.y - centre.y};
}

// Warps the object's box and mask. False if nothing of it stays in the image.
bool move(MovableObject& object, const cv::Matx23d& motion, const cv::Size& image) {
  const cv::Rect& box = object.box;
  std::vector<cv::Point2f> corners;
  for (const auto& corner :
       {cv::Point(box.x, box.y), cv::Point(box.x + box.width, box.y), cv::Point(box.x, box.y + box.height),
        cv::Point(box.x + box.width, box.y + box.height)}) {
    corners.emplace_back(
        static_cast<float>(motion(0, 0) * corner.x + motion(0, 1) * corner.y + motion(0, 2)),
        static_cast<float>(motion(1, 0) * corner.x + motion(1, 1) * corner.y + motion(1, 2)));
  }
  const cv::Rect target = cv::boundingRect(corners) & cv::Rect({0, 0}, image);
  if (target.empty()) return false;
  cv::Matx23d local = motion;  // between the boxes
  local(0, 2) += motion(0, 0) * box.x + motion(0, 1) * box.y - target.x;
  local(1, 2) += motion(1, 0) * box.x + motion(1, 1) * box.y - target.y;
  cv::Mat moved;
  cv::warpAffine(object.mask, moved, local, target.size(), cv::INTER_NEAREST);
  if (cv::countNonZero(moved) == 0) return false;
  object.box = target;
  object.mask = moved;
  return true;
}
}  // namespace

std::vector<MovableObject> predicted_objects(const std::vector<MovableObject>& objects, const PastFrame& from,
                                             const PastFrame& to, const FlowConsistency& flow) {
  const auto matches = common_corners(from, to);
  std::vector<MovableObject> result;
  for (MovableObject object : objects) {
    std::vector<cv::Point2f> before;
    std::vector<cv::Point2f> after;
    for (const CornerMatch& match : matches) {
      if (!covers(object, match.from->pixel)) continue;
      before.push_back(match.from->pixel);
      after.push_back(match.to->pixel);
    }
    const auto motion =
        before.size() >= kMinFlowPoints ? similarity(before, after) : camera_motion(object, from, to, flow);
    if (move(object, motion, to.pyramid.image)) result.push_back(std::move(object));
  }
  return result;
}

void ObjectTracker::carry(const PastFrame& last, const PastFrame& current, const FlowConsistency& flow) {
  objects_ = predicted_objects(objects_, last, current, flow);
}

MovableObject* ObjectTracker::best_match(const MovableObject& object, const std::vector<bool>& taken) {
  MovableObject* best = nullptr;
  int most = 0;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (taken[i]) continue;
    // By common pixels, not by overlap, which a fragment within the object would win.
    const int common = common_pixels(objects_[i], object);
    if (common > most && overlap(objects_[i], object) > kMinOverlap) {
      most = common;
      best = &objects_[i];
    }
  }
  return best;
}

void ObjectTracker::update_labelled(std::vector<MovableObject> labelled, double timestamp) {
  std::vector<bool> taken(objects_.size(), false);
  bool is_flicker = false;
  for (auto& object : labelled) {
    const MovableObject* match = best_match(object, taken);
    object.id = match != nullptr ? match->id : ++last_id_;
    object.last_seen = timestamp;
    if (match == nullptr) continue;
    object.decayed_confidence = std::max(object.confidence, kDecay * match->decayed_confidence);
    object.times_seen = match->times_seen + 1;
    is_flicker = is_flicker || (match->kind != Movable::kUnknown && match->misses > 0);
    taken[static_cast<std::size_t>(match - objects_.data())] = true;
  }
  if (is_flicker) ++flickers_;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (taken[i]) continue;
    MovableObject& object = objects_[i];
    if (object.kind != Movable::kUnknown) {
      ++object.misses;
      object.decayed_confidence *= kDecay;
      const bool is_confident = static_cast<double>(object.decayed_confidence) >= options_.min_confidence;
      if (timestamp - object.last_seen > (is_confident ? options_.keep_missed : kKeepUncertain)) continue;
    }
    labelled.push_back(std::move(object));
  }
  objects_ = std::move(labelled);
}

std::vector<int> ObjectTracker::update_unlabelled(std::vector<MovableObject> found, double timestamp) {
  std::vector<int> ids;
  std::vector<bool> taken(objects_.size(), false);
  std::vector<MovableObject> updated;
  for (auto& object : found) {
    const MovableObject* match = best_match(object, taken);
    const bool is_explained = match != nullptr && match->kind != Movable::kUnknown;
    ids.push_back(is_explained ? 0 : match != nullptr ? match->id : ++last_id_);
    if (is_explained) continue;
    object.id = ids.back();
    object.last_seen = timestamp;
    if (match != nullptr) {
      taken[static_cast<std::size_t>(match - objects_.data())] = true;
      object.times_seen = match->times_seen + 1;
    }
    updated.push_back(std::move(object));
  }
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    MovableObject& object = objects_[i];
    const bool is_unlabelled = object.kind == Movable::kUnknown;
    if (is_unlabelled && (taken[i] || timestamp - object.last_seen > kKeepUnlabelled)) continue;
    if (is_unlabelled && object.last_seen < timestamp) ++object.misses;
    updated.push_back(std::move(object));
  }
  objects_ = std::move(updated);
  return ids;
}

}  // namespace roslam
