// SPDX-License-Identifier: BSD-3-Clause
#include "benchmarks/synthetic.hpp"

#include <algorithm>
#include <numeric>

#include "simulation/simulated_source.hpp"

namespace roslam::benchmarks {

using namespace simulation;

namespace {
double uniform(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double normal(std::mt19937& random, double sigma) {
  return std::normal_distribution<double>(0.0, sigma)(random);
}

Eigen::Vector2d random_pixel(const Camera& camera, std::mt19937& random) {
  const double x = uniform(random, 0.0, camera.width - 1.0);
  const double y = uniform(random, 0.0, camera.height - 1.0);
  return {x, y};
}

Descriptor random_descriptor(std::mt19937& random) {
  Descriptor descriptor{};
  for (auto& word : descriptor) word = (std::uint64_t{random()} << 32U) | random();
  return descriptor;
}

// Twist with the given standard deviations of translation (metres) and rotation (radians).
SE3 small_motion(double metres, double radians, std::mt19937& random) {
  Vector6d twist;
  for (int i = 0; i < 6; ++i) twist[i] = normal(random, i < 3 ? metres : radians);
  return SE3::exp(twist);
}

// Measurement of a point at the finest pyramid level, with the default noise.
Measurement measure(const Camera& camera, const Eigen::Vector3d& point_camera, std::mt19937& random) {
  const MeasurementNoise noise;
  const double x = normal(random, noise.pixel_sigma);
  const double y = normal(random, noise.pixel_sigma);
  const double depth = point_camera.z() + normal(random, noise.sigma_of_depth(point_camera.z()));
  const Eigen::Vector2d pixel = camera.project(point_camera) + Eigen::Vector2d(x, y);
  return Measurement::make(pixel.cast<float>(), static_cast<float>(depth), 1.0F, noise);
}

void index_points(ObservedFrame& frame) {
  frame.grid = FeatureGrid(frame.pixels, synthetic_camera().undistorted_bounds());
}
}  // namespace

const std::vector<Frame>& RenderedFlight::frames() {
  render();
  return frames_;
}

const Camera& RenderedFlight::camera() {
  render();
  return camera_;
}

void RenderedFlight::render() {
  if (!frames_.empty()) return;
  SimulatorOptions options;
  options.traffic = TrafficLevel::kNone;
  options.frames = wanted_;
  Simulator simulator(options);
  camera_ = simulator.camera();
  for (std::size_t i = 0; i < simulator.size(); ++i) frames_.push_back(simulator.render(i).frame);
}

Camera synthetic_camera() { return {}; }

ObservedFrame random_frame(std::size_t points, std::mt19937& random) {
  const Camera camera = synthetic_camera();
  ObservedFrame frame;
  for (std::size_t i = 0; i < points; ++i) {
    frame.pixels.push_back(random_pixel(camera, random).cast<float>());
    frame.depths.push_back(static_cast<float>(uniform(random, 1.0, 8.0)));
    frame.levels.push_back(static_cast<std::uint8_t>(8 * i / points));
    frame.angles.push_back(static_cast<float>(uniform(random, 0.0, 360.0)));
    frame.colours.emplace_back(128, 128, 128);
    frame.descriptors.push_back(random_descriptor(random));
  }
  index_points(frame);
  return frame;
}

ObservedFrame seen_again(const ObservedFrame& frame, int flipped_bits, std::mt19937& random) {
  std::vector<std::size_t> order(frame.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  ObservedFrame again;
  for (const std::size_t i : order) {
    Descriptor descriptor = frame.descriptors[i];
    for (int k = 0; k < flipped_bits; ++k) {
      const auto bit = random() % static_cast<unsigned>(kDescriptorBits);
      descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
    again.pixels.push_back(frame.pixels[i]);
    again.depths.push_back(frame.depths[i]);
    again.levels.push_back(frame.levels[i]);
    again.angles.push_back(frame.angles[i]);
    again.colours.push_back(frame.colours[i]);
    again.descriptors.push_back(descriptor);
  }
  index_points(again);
  return again;
}

PoseScene make_pose_scene(std::size_t measurements, double outlier_share, std::mt19937& random) {
  const Camera camera = synthetic_camera();
  PoseScene scene;
  scene.true_T_camera_world = small_motion(1.0, 0.5, random);
  const SE3 T_world_camera = scene.true_T_camera_world.inverse();
  const auto outliers = static_cast<std::size_t>(outlier_share * static_cast<double>(measurements));
  for (std::size_t i = 0; i < measurements; ++i) {
    const Eigen::Vector3d point = camera.unproject(random_pixel(camera, random), uniform(random, 1.0, 8.0));
    Measurement measurement = measure(camera, point, random);
    if (i < outliers) measurement.pixel = random_pixel(camera, random);
    scene.measurements.push_back({T_world_camera * point, measurement});
  }
  scene.initial_T_camera_world = small_motion(0.03, 0.01, random) * scene.true_T_camera_world;
  return scene;
}

BundleProblem make_bundle(const BundleSize& size, std::mt19937& random) {
  constexpr double kStep = 0.1;  // metres between poses: every point stays in view of every one of them
  const Camera camera = synthetic_camera();
  BundleProblem problem;
  std::vector<SE3> true_poses;
  for (std::size_t i = 0; i < size.poses; ++i) {
    const Eigen::Vector3d centre(kStep * static_cast<double>(i), 0.0, 0.0);
    true_poses.push_back(SE3(Eigen::Quaterniond::Identity(), centre).inverse());
    const SE3 error = i == 0 ? SE3() : small_motion(0.01, 0.005, random);
    problem.poses.push_back({error * true_poses.back(), i == 0});
  }
  const std::size_t seen_by = std::min(size.observations_each, size.poses);
  for (std::size_t p = 0; p < size.points; ++p) {
    const Eigen::Vector3d point(uniform(random, -1.0, 2.0), uniform(random, -1.5, 1.5),
                                uniform(random, 4.0, 8.0));
    const Eigen::Vector3d error(normal(random, 0.02), normal(random, 0.02), normal(random, 0.02));
    problem.points.push_back(point + error);
    const std::size_t first = p % (size.poses - seen_by + 1);
    for (std::size_t i = first; i < first + seen_by; ++i) {
      problem.terms.push_back({i, p, measure(camera, true_poses[i] * point, random)});
    }
  }
  return problem;
}

}  // namespace roslam::benchmarks
