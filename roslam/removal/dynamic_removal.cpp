// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/dynamic_removal.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/removal/mask_growth.hpp"
#include "roslam/removal/mask_refinement.hpp"
#include "roslam/removal/object_evidence.hpp"

namespace roslam {

namespace {
constexpr double kLookBack = 0.6;  // seconds of frames that late labels can be carried from

std::optional<std::size_t> position_of(int id, const std::vector<int>& ids) {
  const auto found = std::find(ids.begin(), ids.end(), id);
  if (found == ids.end()) return std::nullopt;
  return static_cast<std::size_t>(found - ids.begin());
}

// Whether a labelled thing is to go: a doubtful one only if it lasts and is not seen to rest.
bool is_removable(const MovableObject& object, bool is_sure, const ObjectEvidence& evidence,
                  const RemovalOptions& options) {
  constexpr int kConfirmed = 3;  // labels that a doubtful thing must be seen in: noise comes and goes
  if (is_sure && !options.keep_resting) return true;
  return (is_sure || object.sightings >= kConfirmed) && !seems_at_rest(evidence, options);
}
}  // namespace

cv::Mat removed_area(const Removal& removal, const cv::Size& picture, int margin) {
  if (removal.objects.empty()) return {};
  cv::Mat mask = cv::Mat::zeros(picture, CV_8UC1);
  for (const MovableObject& object : removal.objects) paint(object, mask);
  return dilated(mask, margin);
}

DynamicRemoval::DynamicRemoval(const Camera& camera, const Settings& settings)
    : camera_(camera),
      settings_(settings),
      grid_(camera),
      flow_(camera, settings.removal, settings.depth, settings.noise, settings.pose),
      history_(settings.removal, settings.noise),
      memory_(settings.removal) {
  settings.removal.validate();
}

Removal DynamicRemoval::find(const Frame& frame, const cv::Mat& grey,
                             const std::optional<SE3>& predicted_T_camera_world,
                             const std::optional<LabelledFrame>& labels) {
  const RemovalOptions& options = settings_.removal;
  begin(frame, grey, predicted_T_camera_world);
  if (!options.carry) memory_.clear();
  if (!past_.empty()) memory_.carry(past_.back(), current_, flow_);
  CellScene scene = gather_evidence();
  const std::vector<MovableObject> before = memory_.objects();
  if (options.labels && labels) {
    if (auto objects = usable_objects(*labels)) {
      labelled_index_ = labels->index;
      memory_.join(std::move(*objects), current_.timestamp);
    }
  }
  claim_cells(scene, memory_.objects(), before, grid_, options);
  weigh(scene);
  if (options.free_space && !history_.empty()) {
    const cv::Mat barrier = scene.cells_that_are(Evidence::kStatic);
    grow(scene.owners, {depth_cells_, barrier, scene.seeds, scene.moving}, grid_, options.growth);
  }
  if (options.free_space || options.flow) add_unlabelled(scene);
  return finished(scene);
}

void DynamicRemoval::begin(const Frame& frame, const cv::Mat& grey,
                           const std::optional<SE3>& predicted_T_camera_world) {
  current_ = {frame.index, frame.timestamp, flow_pyramid(grey), frame.depth, predicted_T_camera_world, {},
              {}};
  depth_cells_ = grid_.depth_cells(frame.depth, settings_.depth);
  pose_from_flow_.reset();
  if (predicted_T_camera_world && !past_.empty()) {
    pose_from_flow_ = flow_.camera_pose(past_.back(), current_, *predicted_T_camera_world);
    if (pose_from_flow_) current_.T_camera_world = pose_from_flow_;
  }
}

CellScene DynamicRemoval::gather_evidence() const {
  const RemovalOptions& options = settings_.removal;
  CellScene scene;
  scene.depth = depth_cells_;
  if (options.free_space && current_.T_camera_world) {
    scene.space = history_.examine(grid_, depth_cells_, *current_.T_camera_world, current_.timestamp);
  } else {
    scene.space = {cv::Mat::zeros(grid_.size(), CV_8UC1), cv::Mat::zeros(grid_.size(), CV_32FC1)};
  }
  if (const PastFrame* past = options.flow ? anchor() : nullptr) {
    scene.flow = flow_.follow(*past, current_);
    drop_contradicted(scene);
  }
  scene.moving = scene.cells_that_are(Evidence::kMoving);
  for (const auto& point : flow_.in_company(scene.flow)) {
    cv::circle(scene.moving, grid_.cell_of(point), 1, 255, cv::FILLED);
  }
  scene.owners = cv::Mat::zeros(grid_.size(), CV_32SC1);
  scene.seeds = scene.moving.clone();
  return scene;
}

// Depth holds for moving what a pose that went astray, or a bad reading, sets apart; points that were
// followed over it and are at rest show that it is not.
void DynamicRemoval::drop_contradicted(CellScene& scene) const {
  cv::Mat numbers;
  const int count = cv::connectedComponents(scene.cells_that_are(Evidence::kMoving), numbers, 8, CV_32S);
  const auto evidence = evidence_by_owner(numbers, static_cast<std::size_t>(count), scene.space, scene.flow,
                                          grid_, settings_.removal);
  for (int n = 1; n < count; ++n) {
    if (!contradicts_motion(evidence[static_cast<std::size_t>(n)])) continue;
    scene.space.state.setTo(static_cast<int>(Evidence::kUnknown), numbers == n);
  }
}

const PastFrame* DynamicRemoval::past_frame(std::size_t index) const {
  const auto found =
      std::find_if(past_.begin(), past_.end(), [&](const auto& p) { return p.index == index; });
  return found == past_.end() ? nullptr : &*found;
}

// The frame that motion is measured from: far enough back for motion to show.
const PastFrame* DynamicRemoval::anchor() const {
  const PastFrame* best = nullptr;
  for (const PastFrame& past : past_) {
    if (best == nullptr || current_.timestamp - past.timestamp >= settings_.removal.flow_interval)
      best = &past;
  }
  return best;
}

// The things that labels show, in the current frame; nothing if the labels cannot be used.
std::optional<std::vector<MovableObject>> DynamicRemoval::usable_objects(const LabelledFrame& labels) {
  const cv::Mat& image = labels.segmentation.labels;
  if (image.type() != CV_8UC1 || image.size() != cv::Size(camera_.width, camera_.height)) {
    ++faults_["labels have another size than the picture"];
    return std::nullopt;
  }
  const double movable = cv::countNonZero(movable_mask(image));
  if (movable > settings_.removal.max_labelled_share * static_cast<double>(image.total())) {
    ++faults_["nearly everything is labelled as movable"];
    return std::nullopt;
  }
  const double least = settings_.removal.min_object_share;
  if (labels.index == current_.index) return find_objects(labels.segmentation, depth_cells_, grid_, least);
  const PastFrame* past = settings_.removal.carry ? past_frame(labels.index) : nullptr;
  if (past == nullptr) {
    ++faults_["labels came too late"];
    return std::nullopt;
  }
  const cv::Mat depth = grid_.depth_cells(past->depth, settings_.depth);
  return carried(find_objects(labels.segmentation, depth, grid_, least), *past, current_, flow_);
}

// Decides which things rest, and lets go of those that were doubtful and are seen not to move.
void DynamicRemoval::weigh(CellScene& scene) {
  const RemovalOptions& options = settings_.removal;
  if (!options.free_space && !options.flow) return;
  auto& objects = memory_.objects();
  const auto evidence =
      evidence_by_owner(scene.owners, objects.size(), scene.space, scene.flow, grid_, options);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    MovableObject& object = objects[i];
    const int number = static_cast<int>(i) + 1;
    const bool is_sure =
        object.kind != Movable::kUnknown && static_cast<double>(object.sureness) >= options.sure;
    object.is_at_rest = is_sure && rests(evidence[i + 1], options);
    object.is_believed = object.kind == Movable::kUnknown
                             ? !contradicts_motion(evidence[i + 1])
                             : is_removable(object, is_sure, evidence[i + 1], options);
    if (!object.is_believed) scene.owners.setTo(0, scene.owners == number);
    // Only what no thing owns is looked through for new ones: those known by now are seen again here.
    constexpr int kFewest = 4;  // cells: one or two may be noise
    if (object.kind == Movable::kUnknown && object.is_believed &&
        cv::countNonZero(scene.moving & (scene.owners == number)) >= kFewest) {
      object.last_seen = current_.timestamp;
      object.misses = 0;
    }
  }
}

// What moves and belongs to no labelled thing becomes things of its own.
void DynamicRemoval::add_unlabelled(CellScene& scene) {
  const RemovalOptions& options = settings_.removal;
  const cv::Mat seeds = scene.moving & (scene.owners == 0);
  cv::Mat joined;
  cv::dilate(seeds, joined, cv::Mat());
  cv::Mat numbers;
  const int count = cv::connectedComponents(joined, numbers, 4, CV_32S);
  numbers.setTo(0, seeds == 0);
  const cv::Mat barrier = scene.cells_that_are(Evidence::kStatic) | (scene.owners != 0);
  grow(numbers, {depth_cells_, barrier, seeds, scene.moving}, grid_, options.growth);
  const auto evidence =
      evidence_by_owner(numbers, static_cast<std::size_t>(count), scene.space, scene.flow, grid_, options);
  const double least = std::max(8.0, options.min_object_share * static_cast<double>(grid_.cells()));
  std::vector<MovableObject> found;
  std::vector<int> found_numbers;
  for (int n = 1; n < count; ++n) {
    const auto& e = evidence[static_cast<std::size_t>(n)];
    if (e.cells < least || contradicts_motion(e)) continue;
    MovableObject object;
    object.kind = Movable::kUnknown;
    if (!take_mask(object, grid_.in_pixels(numbers == n))) continue;
    object.median_depth = median_depth(object, depth_cells_, grid_);
    found.push_back(std::move(object));
    found_numbers.push_back(n);
  }
  std::vector<int> old_ids;
  for (const auto& object : memory_.objects()) old_ids.push_back(object.id);
  const std::vector<int> found_ids = memory_.join_unlabelled(std::move(found), current_.timestamp);
  // Joining has changed the order.
  cv::Mat owners = cv::Mat::zeros(grid_.size(), CV_32SC1);
  const auto& objects = memory_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const int number = static_cast<int>(i) + 1;
    if (const auto old = position_of(objects[i].id, old_ids)) {
      owners.setTo(number, scene.owners == static_cast<int>(*old) + 1);
    }
    const auto now = position_of(objects[i].id, found_ids);
    if (now && is_confirmed(objects[i])) owners.setTo(number, numbers == found_numbers[*now]);
  }
  scene.owners = owners;
}

Removal DynamicRemoval::finished(const CellScene& scene) {
  Removal removal;
  removal.T_camera_world = pose_from_flow_;
  removal.label_age = labelled_index_ ? static_cast<int>(current_.index - *labelled_index_) : -1;
  auto& objects = memory_.objects();
  if (objects.empty()) return removal;
  const cv::Mat owners = owners_of_pixels(scene, objects, current_.depth, grid_, settings_.removal);
  const cv::Mat mask = owners != 0;
  cv::Mat resting = cv::Mat::zeros(mask.size(), CV_8UC1);
  std::vector<MovableObject> kept;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    MovableObject& object = objects[i];
    if (!take_mask(object, owners == static_cast<int>(i) + 1)) {
      // Not in the mask now, but the next frame may tell otherwise.
      if (!object.is_believed || object.kind == Movable::kUnknown) kept.push_back(object);
      continue;
    }
    object.median_depth = median_depth(object, depth_cells_, grid_);
    if (object.is_at_rest) paint(object, resting);
    kept.push_back(object);
    removal.objects.push_back(object);
  }
  objects = kept;
  if (cv::countNonZero(mask) == 0) return removal;
  const int margin = settings_.removal.margin;
  removal.mask = dilated(mask, margin);
  // Only what no other thing comes near to.
  if (cv::countNonZero(resting) > 0) removal.resting = dilated_apart(resting, mask, margin);
  return removal;
}

void DynamicRemoval::move_world(const SE3& T_new_old) {
  for (auto& past : past_) {
    if (past.T_camera_world) past.T_camera_world = *past.T_camera_world * T_new_old.inverse();
  }
  history_.move_world(T_new_old);
}

void DynamicRemoval::leave_world() {
  for (auto& past : past_) past.T_camera_world.reset();
  history_.clear();
}

void DynamicRemoval::remember(const std::optional<SE3>& T_camera_world, std::vector<cv::Point2f> points,
                              std::vector<cv::Point2f> removed_points) {
  current_.T_camera_world = T_camera_world;
  current_.points = std::move(points);
  current_.moving_points = std::move(removed_points);
  if (T_camera_world && settings_.removal.free_space) {
    history_.add(depth_cells_, *T_camera_world, current_.timestamp);
  }
  while (!past_.empty() && current_.timestamp - past_.front().timestamp > kLookBack) past_.pop_front();
  past_.push_back(std::move(current_));
  current_ = {};
}

}  // namespace roslam
