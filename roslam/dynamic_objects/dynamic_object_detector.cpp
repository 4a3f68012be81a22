// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/dynamic_object_detector.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/common/widened.hpp"
#include "roslam/dynamic_objects/mask_growth.hpp"
#include "roslam/dynamic_objects/mask_refinement.hpp"
#include "roslam/dynamic_objects/object_evidence.hpp"

namespace roslam {

namespace {
constexpr double kPastKept = 0.6;  // seconds of past frames kept, from which late labels can be propagated

std::optional<std::size_t> position_of(int id, const std::vector<int>& ids) {
  const auto found = std::find(ids.begin(), ids.end(), id);
  if (found == ids.end()) return std::nullopt;
  return static_cast<std::size_t>(found - ids.begin());
}

// Whether a labelled object is removed: one of low confidence only if it lasts and does not seem at rest.
bool is_removable(const MovableObject& object, bool is_confident, const ObjectEvidence& evidence,
                  const DynamicObjectOptions& options) {
  constexpr int kMinSeen = 3;  // labels that must show an object of low confidence, as noise does not last
  if (is_confident && !options.keep_resting) return true;
  return (is_confident || object.times_seen >= kMinSeen) && !seems_at_rest(evidence, options);
}
}  // namespace

cv::Mat removed_area(const DynamicObjects& dynamic_objects, const cv::Size& image, int margin) {
  if (dynamic_objects.objects.empty()) return {};
  cv::Mat mask = cv::Mat::zeros(image, CV_8UC1);
  for (const MovableObject& object : dynamic_objects.objects) draw_object(object, mask);
  return dilated(mask, margin);
}

DynamicObjectDetector::DynamicObjectDetector(const Camera& camera, const Settings& settings)
    : camera_(camera),
      settings_(settings),
      grid_(camera),
      corners_(camera),
      flow_(camera, settings.dynamic_objects, settings.depth, settings.noise, settings.pose),
      history_(settings.dynamic_objects, settings.noise.depth_noise()),
      object_tracker_(settings.dynamic_objects) {
  settings.dynamic_objects.validate();
}

DynamicObjects DynamicObjectDetector::detect(const Frame& frame, const cv::Mat& grey,
                                             const std::optional<SE3>& predicted_T_camera_world,
                                             const std::optional<LabelledFrame>& labels,
                                             bool examine_geometry) {
  const DynamicObjectOptions& options = settings_.dynamic_objects;
  begin_frame(frame, grey, predicted_T_camera_world);
  if (!options.carry) object_tracker_.clear();
  if (!past_.empty()) object_tracker_.carry(past_.back(), current_, flow_);
  CellScene scene = gather_evidence(examine_geometry);
  const std::vector<MovableObject> propagated = object_tracker_.objects();
  if (options.labels && labels) {
    if (auto objects = labelled_objects(*labels)) {
      labelled_index_ = labels->index;
      object_tracker_.update_labelled(std::move(*objects), current_.timestamp);
    }
  }
  assign_cells(scene, object_tracker_.objects(), propagated, grid_, options);
  assess_objects(scene);
  if (options.depth_consistency && !history_.empty()) {
    const cv::Mat barrier = scene.cells_that_are(MotionEvidence::kStatic);
    grow_masks(scene.owners, {cells_.depth, barrier, scene.seeds, scene.moving}, grid_, options.growth);
  }
  if (examine_geometry && (options.depth_consistency || options.flow)) add_unlabelled(scene);
  DynamicObjects dynamic_objects = compose_masks(scene);
  mask_ = dynamic_objects.mask;
  still_ = dynamic_objects.still;
  return dynamic_objects;
}

void DynamicObjectDetector::begin_frame(const Frame& frame, const cv::Mat& grey,
                                        const std::optional<SE3>& predicted_T_camera_world) {
  current_ = {frame.index, frame.timestamp, flow_pyramid(grey), frame.depth, predicted_T_camera_world, {}};
  cells_ = {grid_.depth_cells(frame.depth, settings_.depth), grid_.grey_cells(grey)};
  pose_from_flow_.reset();
  if (!past_.empty()) pose_from_flow_ = flow_.track(past_.back(), current_);
}

CellScene DynamicObjectDetector::gather_evidence(bool examine_geometry) {
  const DynamicObjectOptions& options = settings_.dynamic_objects;
  CellScene scene;
  scene.depth = cells_.depth;
  if (examine_geometry && options.depth_consistency && current_.T_camera_world) {
    scene.depth_evidence = history_.examine(grid_, cells_, *current_.T_camera_world, current_.timestamp);
  } else {
    scene.depth_evidence = {cv::Mat::zeros(grid_.size(), CV_8UC1), cv::Mat::zeros(grid_.size(), CV_32FC1)};
  }
  if (const PastFrame* past = examine_geometry && options.flow ? flow_reference() : nullptr) {
    scene.flow = flow_.follow(*past, current_);
    reject_contradicted_motion(scene);
  }
  scene.moving = scene.cells_that_are(MotionEvidence::kMoving);
  for (const auto& point : flow_.in_company(scene.flow)) {
    cv::circle(scene.moving, grid_.cell_of(point), 1, 255, cv::FILLED);
  }
  scene.owners = cv::Mat::zeros(grid_.size(), CV_32SC1);
  scene.seeds = scene.moving.clone();
  return scene;
}

// A wrong pose or depth makes static regions appear moving in depth consistency; tracked points on them that
// are at rest reject these.
void DynamicObjectDetector::reject_contradicted_motion(CellScene& scene) const {
  cv::Mat numbers;
  const int count =
      cv::connectedComponents(scene.cells_that_are(MotionEvidence::kMoving), numbers, 8, CV_32S);
  const auto evidence = evidence_by_owner(numbers, static_cast<std::size_t>(count), scene.depth_evidence,
                                          scene.flow, grid_, settings_.dynamic_objects);
  for (int n = 1; n < count; ++n) {
    if (!contradicts_motion(evidence[static_cast<std::size_t>(n)])) continue;
    scene.depth_evidence.state.setTo(static_cast<int>(MotionEvidence::kUnknown), numbers == n);
  }
}

const PastFrame* DynamicObjectDetector::past_frame(std::size_t index) const {
  const auto found =
      std::find_if(past_.begin(), past_.end(), [&](const auto& p) { return p.index == index; });
  return found == past_.end() ? nullptr : &*found;
}

// The frame that points are tracked from: old enough for motion to be measurable.
const PastFrame* DynamicObjectDetector::flow_reference() const {
  const PastFrame* best = nullptr;
  for (const PastFrame& past : past_) {
    if (best == nullptr || current_.timestamp - past.timestamp >= settings_.dynamic_objects.flow_interval)
      best = &past;
  }
  return best;
}

// The labelled objects, propagated to the current frame; nothing if the labels cannot be used.
std::optional<std::vector<MovableObject>> DynamicObjectDetector::labelled_objects(
    const LabelledFrame& labels) {
  const cv::Mat& image = labels.segmentation.labels;
  if (image.type() != CV_8UC1 || image.size() != cv::Size(camera_.width, camera_.height)) {
    ++faults_["labels have another size than the image"];
    return std::nullopt;
  }
  const double movable = cv::countNonZero(movable_mask(image));
  is_everything_labelled_ =
      movable > settings_.dynamic_objects.max_labelled_share * static_cast<double>(image.total());
  if (is_everything_labelled_) {
    ++faults_["nearly everything is labelled as movable"];
    return std::nullopt;
  }
  const double least = settings_.dynamic_objects.min_object_share;
  if (labels.index == current_.index) return find_objects(labels.segmentation, cells_.depth, grid_, least);
  const PastFrame* past = settings_.dynamic_objects.carry ? past_frame(labels.index) : nullptr;
  if (past == nullptr) {
    ++faults_["labels came too late"];
    return std::nullopt;
  }
  const cv::Mat depth = grid_.depth_cells(past->depth, settings_.depth);
  return predicted_objects(find_objects(labels.segmentation, depth, grid_, least), *past, current_, flow_);
}

// Decides which objects are at rest and which are confirmed; the cells of unconfirmed ones are released.
void DynamicObjectDetector::assess_objects(CellScene& scene) {
  const DynamicObjectOptions& options = settings_.dynamic_objects;
  if (!options.depth_consistency && !options.flow) return;
  auto& objects = object_tracker_.objects();
  const auto evidence =
      evidence_by_owner(scene.owners, objects.size(), scene.depth_evidence, scene.flow, grid_, options);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    MovableObject& object = objects[i];
    const int number = static_cast<int>(i) + 1;
    const bool is_confident = object.kind != Movable::kUnknown &&
                              static_cast<double>(object.decayed_confidence) >= options.min_confidence;
    object.is_at_rest = is_confident && has_rested(evidence[i + 1], options);
    object.is_confirmed = object.kind == Movable::kUnknown
                              ? !contradicts_motion(evidence[i + 1])
                              : is_removable(object, is_confident, evidence[i + 1], options);
    if (!object.is_confirmed) scene.owners.setTo(0, scene.owners == number);
    // New unlabelled objects are only sought in cells without an owner: known ones are updated here.
    constexpr int kMinCells = 4;  // cells: one or two may be noise
    if (object.kind == Movable::kUnknown && object.is_confirmed &&
        cv::countNonZero(scene.moving & (scene.owners == number)) >= kMinCells) {
      object.last_seen = current_.timestamp;
      object.misses = 0;
    }
  }
}

// Creates unlabelled objects from moving cells without an owner.
void DynamicObjectDetector::add_unlabelled(CellScene& scene) {
  const DynamicObjectOptions& options = settings_.dynamic_objects;
  const cv::Mat seeds = scene.moving & (scene.owners == 0);
  cv::Mat joined;
  cv::dilate(seeds, joined, cv::Mat());
  cv::Mat numbers;
  const int count = cv::connectedComponents(joined, numbers, 4, CV_32S);
  numbers.setTo(0, seeds == 0);
  const cv::Mat barrier = scene.cells_that_are(MotionEvidence::kStatic) | (scene.owners != 0);
  grow_masks(numbers, {cells_.depth, barrier, seeds, scene.moving}, grid_, options.growth);
  const auto evidence = evidence_by_owner(numbers, static_cast<std::size_t>(count), scene.depth_evidence,
                                          scene.flow, grid_, options);
  const double least = std::max(8.0, options.min_object_share * static_cast<double>(grid_.cells()));
  const std::vector<cv::Rect> boxes = boxes_of_numbers(numbers, count);
  std::vector<MovableObject> found;
  std::vector<int> found_numbers;
  for (int n = 1; n < count; ++n) {
    const auto& e = evidence[static_cast<std::size_t>(n)];
    if (e.cells < least || contradicts_motion(e)) continue;
    const cv::Rect& box = boxes[static_cast<std::size_t>(n)];
    MovableObject object;
    object.kind = Movable::kUnknown;
    object.box = grid_.pixels_of(box);
    object.mask = grid_.in_pixels(numbers(box) == n, box);
    object.median_depth = median_depth(object, cells_.depth, grid_);
    found.push_back(std::move(object));
    found_numbers.push_back(n);
  }
  std::vector<int> old_ids;
  for (const auto& object : object_tracker_.objects()) old_ids.push_back(object.id);
  const std::vector<int> found_ids = object_tracker_.update_unlabelled(std::move(found), current_.timestamp);
  // The update has changed the order of the objects.
  std::vector<int> owner_of_old(old_ids.size() + 1, 0);
  std::vector<int> owner_of_number(static_cast<std::size_t>(count) + 1, 0);
  const auto& objects = object_tracker_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const int owner = static_cast<int>(i) + 1;
    if (const auto old = position_of(objects[i].id, old_ids)) owner_of_old[*old + 1] = owner;
    const auto now = position_of(objects[i].id, found_ids);
    if (now && is_seen_repeatedly(objects[i]))
      owner_of_number[static_cast<std::size_t>(found_numbers[*now])] = owner;
  }
  for (std::size_t i = 0; i < grid_.cells(); ++i) {
    int& owner = scene.owners.ptr<int>()[i];
    const int found_owner = owner_of_number[static_cast<std::size_t>(numbers.ptr<int>()[i])];
    owner = found_owner != 0 ? found_owner : owner_of_old[static_cast<std::size_t>(owner)];
  }
}

// The parts of labelled objects that are where they were a second ago, or near points at rest, and far from
// points that move. Some of the surface of a person who walks slowly is among them. mask: of removed pixels.
cv::Mat DynamicObjectDetector::still_part(const CellScene& scene, const cv::Mat& mask) const {
  constexpr double kLongAgo = 1.0;  // seconds
  constexpr int kNear = 2;          // cells around a point at rest
  constexpr int kClear = 5;         // cells around a moving point
  cv::Mat still = scene.depth_evidence.static_for >= kLongAgo;
  still &= scene.cells_that_are(MotionEvidence::kStatic);
  for (const auto& point : scene.flow.at_rest)
    cv::circle(still, grid_.cell_of(point), kNear, 255, cv::FILLED);
  for (const auto& point : scene.flow.moving) cv::circle(still, grid_.cell_of(point), kClear, 0, cv::FILLED);
  cv::Mat labelled = cv::Mat::zeros(grid_.size(), CV_8UC1);
  for (std::size_t i = 0; i < object_tracker_.objects().size(); ++i) {
    if (object_tracker_.objects()[i].kind != Movable::kUnknown)
      labelled |= scene.owners == static_cast<int>(i) + 1;
  }
  still &= labelled & ~scene.moving;
  if (cv::countNonZero(still) == 0) return {};
  const cv::Rect all({0, 0}, grid_.size());
  cv::Mat pixels = cv::Mat::zeros(mask.size(), CV_8UC1);
  grid_.in_pixels(still, all).copyTo(pixels(grid_.pixels_of(all)));
  return pixels & mask;
}

DynamicObjects DynamicObjectDetector::compose_masks(const CellScene& scene) {
  DynamicObjects dynamic_objects;
  dynamic_objects.T_camera_world = pose_from_flow_;
  dynamic_objects.is_everything_labelled = is_everything_labelled_;
  dynamic_objects.label_age = labelled_index_ ? static_cast<int>(current_.index - *labelled_index_) : -1;
  auto& objects = object_tracker_.objects();
  if (objects.empty()) return dynamic_objects;
  const auto [area, owners] =
      owners_of_pixels(scene, objects, current_.depth, grid_, settings_.dynamic_objects);
  const auto boxes = boxes_of_numbers(owners, static_cast<int>(objects.size()));
  const cv::Size image(camera_.width, camera_.height);
  cv::Mat mask = cv::Mat::zeros(image, CV_8UC1);
  cv::Mat resting;
  std::vector<MovableObject> kept;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    MovableObject& object = objects[i];
    cv::Mat object_mask;
    if (!boxes[i + 1].empty()) object_mask = owners(boxes[i + 1]) == static_cast<int>(i) + 1;
    if (cv::countNonZero(object_mask) < grid_.side() * grid_.side()) {
      // Less than a cell is left of it by the refinement: not in this mask, but it may be in the next.
      if (!object.is_confirmed || object.kind == Movable::kUnknown) kept.push_back(object);
      continue;
    }
    object.box = boxes[i + 1] + area.tl();
    object.mask = object_mask;
    object.median_depth = median_depth(object, cells_.depth, grid_);
    draw_object(object, mask);
    if (object.is_at_rest) {
      if (resting.empty()) resting = cv::Mat::zeros(image, CV_8UC1);
      draw_object(object, resting);
    }
    kept.push_back(object);
    dynamic_objects.objects.push_back(object);
  }
  objects = kept;
  if (dynamic_objects.objects.empty()) return dynamic_objects;
  // Without what lies within the margin of another object.
  const int margin = settings_.dynamic_objects.margin;
  const cv::Rect dilated_area = widened(area, margin) & cv::Rect({0, 0}, image);
  if (!resting.empty()) {
    cv::Mat part = resting(dilated_area);
    dilated_apart(part, mask(dilated_area), margin).copyTo(part);
  }
  cv::Mat part = mask(dilated_area);
  dilated(part, margin).copyTo(part);
  dynamic_objects.mask = mask;
  dynamic_objects.resting = resting;
  if (settings_.dynamic_objects.resting_weight > 0.0) dynamic_objects.still = still_part(scene, mask);
  return dynamic_objects;
}

void DynamicObjectDetector::set_depth_noise(const DepthNoise& noise) {
  const DepthNoise used = settings_.noise.at_least(noise);
  flow_.set_depth_noise(used);
  history_.set_depth_noise(used);
}

void DynamicObjectDetector::apply_correction(const SE3& T_new_old) {
  for (auto& past : past_) {
    if (past.T_camera_world) past.T_camera_world = *past.T_camera_world * T_new_old.inverse();
  }
  history_.apply_correction(T_new_old);
}

void DynamicObjectDetector::leave_submap() {
  for (auto& past : past_) past.T_camera_world.reset();
  history_.clear();
}

void DynamicObjectDetector::reset() {
  past_.clear();
  history_.clear();
  object_tracker_.clear();
  is_everything_labelled_ = false;
}

void DynamicObjectDetector::remember(const std::optional<SE3>& T_camera_world,
                                     const std::vector<cv::Point2f>& points,
                                     const std::vector<cv::Point2f>& removed_points) {
  current_.T_camera_world = T_camera_world;
  for (Corner& corner : current_.corners) {
    const cv::Point pixel(static_cast<int>(corner.pixel.x), static_cast<int>(corner.pixel.y));
    const bool is_still = !still_.empty() && still_.at<std::uint8_t>(pixel) != 0;
    corner.is_removed = !mask_.empty() && mask_.at<std::uint8_t>(pixel) != 0 && !is_still;
  }
  corners_.replenish(current_.corners, points, false);
  corners_.replenish(current_.corners, removed_points, true);
  if (T_camera_world && settings_.dynamic_objects.depth_consistency) {
    history_.add(cells_, *T_camera_world, current_.timestamp);
  }
  while (!past_.empty() && current_.timestamp - past_.front().timestamp > kPastKept) past_.pop_front();
  past_.push_back(std::move(current_));
  current_ = {};
}

}  // namespace roslam
