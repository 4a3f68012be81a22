// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/dynamic_removal.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/removal/mask_growth.hpp"
#include "roslam/removal/mask_refinement.hpp"
#include "roslam/removal/object_evidence.hpp"

namespace roslam {

namespace {
constexpr double kLookBack = 0.6;  // seconds of frames that late labels can be carried from

cv::Mat cells_that_are(Evidence evidence, const FreeSpaceEvidence& space) {
  return space.state == static_cast<int>(evidence);
}

bool is_fresh(const MovableObject& object) { return object.misses == 0 && object.kind != Movable::kUnknown; }

cv::Mat square(int pixels) {
  return cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1});
}
}  // namespace

// All images are of cells.
struct DynamicRemoval::Scene {
  FreeSpaceEvidence space;
  FollowedPoints flow;
  cv::Mat moving;  // CV_8UC1: seen to move, by free space or flow
  cv::Mat seeds;   // CV_8UC1: shown to belong to a thing by this frame, and not only by those before
  cv::Mat owners;  // CV_32SC1: number of the object in memory, from 1; 0 = none
};

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
  Scene scene = gather_evidence();
  const std::vector<MovableObject> before = memory_.objects();
  if (options.labels && labels) {
    if (auto objects = usable_objects(*labels)) {
      labelled_index_ = labels->index;
      memory_.join(std::move(*objects), current_.timestamp);
    }
  }
  claim(scene, before);
  weigh(scene);
  if (options.free_space && !history_.empty()) {
    const cv::Mat barrier = cells_that_are(Evidence::kStatic, scene.space);
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

DynamicRemoval::Scene DynamicRemoval::gather_evidence() const {
  const RemovalOptions& options = settings_.removal;
  Scene scene;
  if (options.free_space && current_.T_camera_world) {
    scene.space = history_.examine(grid_, depth_cells_, *current_.T_camera_world, current_.timestamp);
  } else {
    scene.space = {cv::Mat::zeros(grid_.size(), CV_8UC1), cv::Mat::zeros(grid_.size(), CV_32FC1)};
  }
  if (const PastFrame* past = options.flow ? anchor() : nullptr) {
    scene.flow = flow_.follow(*past, current_);
    drop_contradicted(scene.space, scene.flow);
  }
  scene.moving = cells_that_are(Evidence::kMoving, scene.space);
  for (const auto& point : flow_.in_company(scene.flow)) {
    cv::circle(scene.moving, grid_.cell_of(point), 1, 255, cv::FILLED);
  }
  scene.owners = cv::Mat::zeros(grid_.size(), CV_32SC1);
  scene.seeds = scene.moving.clone();
  return scene;
}

// Depth holds for moving what a pose that went astray, or a bad reading, sets apart; points that were
// followed over it and are at rest show that it is not.
void DynamicRemoval::drop_contradicted(FreeSpaceEvidence& space, const FollowedPoints& flow) const {
  cv::Mat numbers;
  const int count = cv::connectedComponents(cells_that_are(Evidence::kMoving, space), numbers, 8, CV_32S);
  const auto evidence =
      evidence_by_owner(numbers, static_cast<std::size_t>(count), space, flow, grid_, settings_.removal);
  for (int n = 1; n < count; ++n) {
    if (!contradicts_motion(evidence[static_cast<std::size_t>(n)])) continue;
    space.state.setTo(static_cast<int>(Evidence::kUnknown), numbers == n);
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

// Gives each cell to the object it shows. before: the objects as they were carried here, without new labels:
// what belonged to a thing a moment ago and moves still belongs to it.
void DynamicRemoval::claim(Scene& scene, const std::vector<MovableObject>& before) const {
  enum class Claim { kAll, kPlausible, kMoving };
  const auto allows = [&](Claim claim, const cv::Point& cell, float middle) {
    const auto state = static_cast<Evidence>(scene.space.state.at<std::uint8_t>(cell));
    if (claim == Claim::kAll || state == Evidence::kMoving) return true;
    constexpr float kReach = 0.35F;  // metres in depth that a thing may extend from its middle
    const float z = depth_cells_.at<float>(cell);
    return claim == Claim::kPlausible && state == Evidence::kUnknown && z > 0.0F &&
           std::abs(z - middle) < kReach;
  };
  const auto claim_for = [&](const MovableObject& object, std::size_t index, Claim claim) {
    const cv::Point begin = grid_.cell_of(object.box.tl());
    const cv::Point end = grid_.cell_of(object.box.br());
    for (int y = begin.y; y <= end.y; ++y) {
      for (int x = begin.x; x <= end.x; ++x) {
        const cv::Point pixel = grid_.pixel_of({x, y});
        if (!object.box.contains(pixel) || object.mask.at<std::uint8_t>(pixel - object.box.tl()) == 0)
          continue;
        int& owner = scene.owners.at<int>(y, x);
        if (owner == 0 && allows(claim, {x, y}, object.median_depth)) owner = static_cast<int>(index) + 1;
      }
    }
  };
  const auto& objects = memory_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (is_fresh(objects[i])) claim_for(objects[i], i, Claim::kAll);
  }
  scene.seeds |= scene.owners != 0;
  const bool has_depth = settings_.removal.free_space;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!is_fresh(objects[i])) claim_for(objects[i], i, has_depth ? Claim::kPlausible : Claim::kAll);
  }
  if (!has_depth) return;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (const auto& past : before) {
      if (past.id == objects[i].id && past.is_believed) claim_for(past, i, Claim::kMoving);
    }
  }
}

// Decides which things rest, and lets go of those that were doubtful and are seen not to move.
void DynamicRemoval::weigh(Scene& scene) {
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
    constexpr int kConfirmed = 3;  // labels that an uncertain thing must be seen in: noise comes and goes
    object.is_believed =
        object.kind == Movable::kUnknown
            ? !contradicts_motion(evidence[i + 1])
            : is_sure || (object.sightings >= kConfirmed && !seems_at_rest(evidence[i + 1], options));
    if (!object.is_believed) scene.owners.setTo(0, scene.owners == number);
  }
}

// What moves and belongs to no labelled thing becomes things of its own.
void DynamicRemoval::add_unlabelled(Scene& scene) {
  const RemovalOptions& options = settings_.removal;
  const cv::Mat seeds = scene.moving & (scene.owners == 0);
  cv::Mat joined;
  cv::dilate(seeds, joined, cv::Mat());
  cv::Mat numbers;
  const int count = cv::connectedComponents(joined, numbers, 4, CV_32S);
  numbers.setTo(0, seeds == 0);
  const cv::Mat barrier = cells_that_are(Evidence::kStatic, scene.space) | (scene.owners != 0);
  grow(numbers, {depth_cells_, barrier, seeds, scene.moving}, grid_, options.growth);
  const auto evidence =
      evidence_by_owner(numbers, static_cast<std::size_t>(count), scene.space, scene.flow, grid_, options);
  const double least = std::max(8.0, options.min_object_share * static_cast<double>(grid_.cells()));
  std::vector<MovableObject> found;
  for (int n = 1; n < count; ++n) {
    const auto& e = evidence[static_cast<std::size_t>(n)];
    if (e.cells < least || contradicts_motion(e)) continue;
    MovableObject object;
    object.kind = Movable::kUnknown;
    if (!take_mask(object, grid_.mask_pixels(numbers == n))) continue;
    object.median_depth = median_depth(object, depth_cells_, grid_);
    found.push_back(std::move(object));
  }
  std::vector<int> ids;
  for (const auto& object : memory_.objects()) ids.push_back(object.id);
  memory_.join_unlabelled(std::move(found), current_.timestamp);
  // Joining has changed the order.
  cv::Mat owners = cv::Mat::zeros(grid_.size(), CV_32SC1);
  const auto& objects = memory_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const int number = static_cast<int>(i) + 1;
    const auto old = std::find(ids.begin(), ids.end(), objects[i].id);
    if (old != ids.end()) owners.setTo(number, scene.owners == static_cast<int>(old - ids.begin()) + 1);
    constexpr int kSightings = 2;  // once may be noise
    const bool is_new = objects[i].kind == Movable::kUnknown && objects[i].misses == 0;
    if (!is_new || objects[i].sightings < kSightings) continue;
    cv::Mat pixels = cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1);
    paint(objects[i], pixels);
    owners.setTo(number, grid_.mask_cells(pixels) & (scene.owners == 0));
  }
  scene.owners = owners;
}

// CV_16UC1: number of the object that each pixel shows, from 1, fitted to depth.
cv::Mat DynamicRemoval::owners_of_pixels(const Scene& scene) const {
  const RemovalOptions& options = settings_.removal;
  cv::Mat cells;
  scene.owners.convertTo(cells, CV_16U);
  cv::Mat owners;
  cv::resize(cells, owners, grid_.size() * grid_.side(), 0, 0, cv::INTER_NEAREST);
  owners = owners(cv::Rect(0, 0, camera_.width, camera_.height)).clone();
  const auto& objects = memory_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    // The network draws finer borders than cells have.
    if (!objects[i].is_believed || (!is_fresh(objects[i]) && options.free_space)) continue;
    cv::Mat view = owners(objects[i].box);
    view.setTo(static_cast<int>(i) + 1, objects[i].mask & (view == 0));
  }
  if (!options.refine) return owners;
  // Nothing is added to what only was there before, or it would grow with every frame.
  cv::Mat near_seeds;
  cv::dilate(scene.seeds, near_seeds, square(options.edge_band / grid_.side() + 1));
  const cv::Mat barrier = cells_that_are(Evidence::kStatic, scene.space) | (near_seeds == 0);
  const cv::Mat mask =
      refine_mask(owners != 0, current_.depth, depth_cells_, barrier, grid_, options.edge_band);
  cv::Mat wider;
  cv::dilate(owners, wider, square(options.edge_band));
  wider.copyTo(owners, owners == 0);
  owners.setTo(0, mask == 0);
  return owners;
}

Removal DynamicRemoval::finished(const Scene& scene) {
  Removal removal;
  removal.T_camera_world = pose_from_flow_;
  removal.label_age = labelled_index_ ? static_cast<int>(current_.index - *labelled_index_) : -1;
  auto& objects = memory_.objects();
  if (objects.empty()) return removal;
  const cv::Mat owners = owners_of_pixels(scene);
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
