// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/composer.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "roslam/restoration/depth_filling.hpp"
#include "simulation/composition/random_stream.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

constexpr std::uint8_t kPersonLabel = 11;  // of Cityscapes' train ids
constexpr std::uint8_t kUnknownLabel = 255;
constexpr double kDarkest = 0.75;     // lowest gain of a person; photos of streets are brighter than rooms
constexpr double kShadowEdge = 0.75;  // pixels

// One random stream for each purpose, so that another actor does not change the others.
enum class Purpose : std::uint32_t { kChoice = 1, kActor = 2, kNoise = 3 };

RandomStream stream(std::uint32_t seed, Purpose purpose, std::uint32_t a = 0, std::uint32_t b = 0) {
  return RandomStream(simulation::mix(seed, static_cast<std::uint32_t>(purpose), simulation::mix(a, b)));
}

ComposerOptions validated(const ComposerOptions& options) {
  options.validate();
  return options;
}

Camera validated(const Camera& camera) {
  camera.validate();
  return camera;
}

Composer::Actor make_actor(const PersonCutout& cutout, const WalkingGround& ground,
                           const ComposerOptions& options, RandomStream random) {
  PersonShape shape;
  shape.height = random.uniform(options.min_height, options.max_height);
  shape.thickness = options.thickness;
  shape.gain = random.uniform(kDarkest, 1.0);
  shape.mirrored = random.chance(0.5);
  return {cutout.name, ComposedPerson(cutout, shape), Walk(ground, options, random)};
}

// Where a person is not occluded by nearer depth. A median filter removes holes from single noisy pixels.
cv::Mat visible_part(const cv::Mat& person_depth, const cv::Mat& nearest) {
  const cv::Mat inside = person_depth > 0.0F;
  const cv::Mat in_front = inside & ((nearest == 0.0F) | (person_depth < nearest));
  cv::Mat even;
  cv::medianBlur(in_front, even, 5);
  // Not along the outline, where the median would remove thin parts such as heels.
  cv::Mat core;
  cv::erode(inside, core, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  even.copyTo(in_front, core);
  return in_front;
}

// How many of a pixel and its eight neighbours are set.
cv::Mat set_around(const cv::Mat& mask) {
  cv::Mat count;
  cv::boxFilter(mask & 1, count, CV_8U, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
  return count;
}

// Blends the person over the image with edges one pixel soft: by alpha at their outline, and by the visible
// share of the 3x3 neighbourhood at occlusions.
void blend(const PersonLayer& layer, const cv::Mat& visible, cv::Mat& colour) {
  const cv::Mat seen = set_around(visible);
  const cv::Mat all = set_around(layer.depth > 0.0F);
  for (int y = 0; y < colour.rows; ++y) {
    for (int x = 0; x < colour.cols; ++x) {
      if (seen.at<std::uint8_t>(y, x) == 0) continue;
      const float share =
          static_cast<float>(seen.at<std::uint8_t>(y, x)) / static_cast<float>(all.at<std::uint8_t>(y, x));
      auto& pixel = colour.at<cv::Vec3f>(y, x);
      pixel = pixel * (1.0F - share * layer.alpha.at<float>(y, x)) + share * layer.colour.at<cv::Vec3f>(y, x);
    }
  }
}

}  // namespace

// A frame on which actors are drawn one after the other.
struct Composer::Canvas {
  cv::Mat colour;     // CV_32FC3
  cv::Mat depth;      // CV_32FC1, as measured, 0 = unknown
  cv::Mat nearest;    // CV_32FC1, depth that occludes the next actor: without noise, holes filled
  cv::Mat instances;  // CV_16UC1
};

Composer::Composer(const Camera& camera, const std::vector<PersonCutout>& people, const Trajectory& poses,
                   const ComposerOptions& options)
    : options_(validated(options)), rays_(validated(camera)), ground_(poses, options_) {
  for (std::size_t i = 0; i < options_.actors; ++i) {
    actors_.push_back(make_actor(people[i % people.size()], ground_, options_,
                                 stream(options_.seed, Purpose::kActor, static_cast<std::uint32_t>(i))));
  }
}

ComposedFrame Composer::compose(const Frame& frame) const {
  CV_Assert(frame.T_world_camera && frame.colour.size() == rays_.size() &&
            frame.depth.size() == rays_.size());
  Canvas canvas{{},
                frame.depth.clone(),
                filled_depth(frame.depth, frame.colour),
                cv::Mat(rays_.size(), CV_16UC1, cv::Scalar(0))};
  frame.colour.convertTo(canvas.colour, CV_32FC3);
  for (std::size_t i = 0; i < actors_.size(); ++i) draw(i, frame, canvas);
  ComposedFrame composed;
  cast_shadow(canvas, canvas.depth);
  const cv::Mat seen = canvas.instances > 0;
  composed.labels = cv::Mat(rays_.size(), CV_8UC1, cv::Scalar(kUnknownLabel));
  composed.labels.setTo(kPersonLabel, seen);
  composed.covered = static_cast<double>(cv::countNonZero(seen)) / static_cast<double>(seen.total());
  canvas.colour.convertTo(composed.colour, CV_8UC3);
  composed.depth = canvas.depth;
  composed.instances = canvas.instances;
  return composed;
}

void Composer::draw(std::size_t actor, const Frame& frame, Canvas& canvas) const {
  const Actor& a = actors_[actor];
  const PersonLayer layer =
      a.person.seen_from(*frame.T_world_camera, rays_, a.walk.feet(frame.timestamp), ground_.up());
  if (layer.depth.empty() || cv::countNonZero(layer.depth) == 0) return;
  const cv::Mat visible = visible_part(layer.depth, canvas.nearest);
  blend(layer, visible, canvas.colour);
  const auto number = static_cast<std::uint16_t>(actor + 1);
  RandomStream random =
      stream(options_.seed, Purpose::kNoise, static_cast<std::uint32_t>(frame.index), number);
  for (int y = 0; y < visible.rows; ++y) {
    for (int x = 0; x < visible.cols; ++x) {
      if (visible.at<std::uint8_t>(y, x) == 0) continue;
      const double z = layer.depth.at<float>(y, x);
      // Nguyen, Izadi and Lovell 2012 measured this law for a structured light camera.
      const double deviation = options_.noise_floor + options_.noise_growth * (z - 0.4) * (z - 0.4);
      canvas.depth.at<float>(y, x) = static_cast<float>(std::max(z + deviation * random.normal(), 0.0));
      canvas.nearest.at<float>(y, x) = static_cast<float>(z);
      canvas.instances.at<std::uint16_t>(y, x) = number;
    }
  }
}

// Depth is unknown where an actor occludes the projector. In the projector's image a point is shifted to the
// left by the disparity; a point that falls to the right of an actor's point that is further right in the
// camera's image is occluded by it.
void Composer::cast_shadow(const Canvas& canvas, cv::Mat& depth) const {
  const double shift = rays_.camera().fx * std::abs(options_.shadow_baseline);  // pixels at one metre
  const bool to_the_left = options_.shadow_baseline > 0.0;
  const cv::Mat before = depth.clone();
  for (int y = 0; y < depth.rows && shift > 0.0; ++y) {
    double leftmost = std::numeric_limits<double>::max();
    for (int i = 0; i < depth.cols; ++i) {
      const int x = to_the_left ? depth.cols - 1 - i : i;
      const double z = before.at<float>(y, x);
      if (z <= 0.0) continue;
      const double seen_at = (to_the_left ? x : -x) - shift / z;
      if (seen_at > leftmost + kShadowEdge) depth.at<float>(y, x) = 0.0F;
      if (canvas.instances.at<std::uint16_t>(y, x) != 0) leftmost = std::min(leftmost, seen_at);
    }
  }
}

std::vector<std::size_t> chosen_people(std::size_t count, const ComposerOptions& options) {
  RandomStream random = stream(options.seed, Purpose::kChoice);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t chosen = std::min(count, options.actors);
  for (std::size_t i = 0; i < chosen; ++i) std::swap(order[i], order[i + random.below(count - i)]);
  order.resize(chosen);
  return order;
}

}  // namespace roslam::simulation
