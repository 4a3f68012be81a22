// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_source.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/timestamp.hpp"
#include "simulation/depth_noise.hpp"
#include "simulation/simulated_city.hpp"
#include "simulation/simulated_corridor.hpp"
#include "simulation/simulated_flight.hpp"
#include "simulation/simulated_imu.hpp"
#include "simulation/simulated_noise.hpp"
#include "simulation/simulated_renderer.hpp"
#include "simulation/simulated_traffic.hpp"

namespace roslam::simulation {
namespace {

using simulation::mix;

Camera camera_for(const SimulatorOptions& options) {
  Camera camera = *camera_preset("simulated");
  camera.fps = options.fps;
  if (options.imu) camera.imu = simulated_imu();
  camera.T_body_camera = Flight(options).T_body_camera();
  if (options.stereo) {
    camera.baseline = options.baseline;
    camera.depth_noise.reset();  // that of the depth camera
  }
  return camera;
}

// Adds sensor noise and rounds to bytes. Each channel's noise is the sum of two uniform numbers; one hash
// gives the bits of all three.
cv::Mat expose(const cv::Mat& colour, double gain, double noise, std::uint32_t seed) {
  constexpr double kSpread = 13.06;  // standard deviation of the sum of two numbers of five bits
  cv::Mat image(colour.size(), CV_8UC3);
  const auto strength = static_cast<float>(noise / kSpread);
  const auto brightness = static_cast<float>(gain);
  for (int y = 0; y < image.rows; ++y) {
    const auto row_seed = mix(seed, static_cast<std::uint32_t>(y));
    const auto* from = colour.ptr<float>(y);
    auto* to = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      auto bits = mix(row_seed + static_cast<std::uint32_t>(x));
      for (int channel = 0; channel < 3; ++channel, bits >>= 10) {
        const auto sum = static_cast<int>((bits & 31U) + (bits >> 5 & 31U));
        const float error = strength * static_cast<float>(sum - 31);
        *to++ = static_cast<std::uint8_t>(std::clamp(brightness * *from++ + error + 0.5F, 0.0F, 255.0F));
      }
    }
  }
  return image;
}

}  // namespace

struct Simulator::Impl {
  explicit Impl(const SimulatorOptions& given)
      : options(given),
        camera(camera_for(given)),
        flight(given),
        traffic(given.path == FlightPath::kCorridor ? Traffic(CorridorPlan(), given.traffic, given.seed)
                                                    : Traffic(plan, given.traffic, given.seed)),
        renderer(plan,
                 given.path == FlightPath::kCorridor ? build_corridor(CorridorPlan(), given.seed)
                                                     : build_city(plan, given.seed),
                 camera, given.seed) {
    frames = static_cast<std::size_t>(std::llround(flight.duration() * options.fps));
    if (options.frames != 0) frames = std::min(frames, options.frames);
  }

  cv::Mat measured(const cv::Mat& depth, std::size_t index) const {
    if (options.depth == DepthModel::kIdeal) return depth;
    return stereo_depth(depth, camera, {}, mix(options.seed, static_cast<std::uint32_t>(index), 0xdeb7U));
  }

  // Of a second camera, whose exposure and noise are its own.
  cv::Mat right_image(const SE3& T_world_camera, std::size_t index) const {
    constexpr double kGain = 0.92;
    const SE3 T_left_right(Eigen::Quaterniond::Identity(), {options.baseline, 0.0, 0.0});
    const simulation::Image image = renderer.draw(T_world_camera * T_left_right);
    const auto seed = mix(options.seed, static_cast<std::uint32_t>(index), 0x2198b7U);
    cv::Mat grey;
    cv::cvtColor(expose(image.colour, kGain * options.gain, options.colour_noise, seed), grey,
                 cv::COLOR_BGR2GRAY);
    return grey;
  }

  SimulatorOptions options;
  Camera camera;
  simulation::CityPlan plan;
  simulation::Flight flight;
  simulation::Traffic traffic;
  simulation::Renderer renderer;
  std::size_t frames = 0;
};

Simulator::Simulator(const SimulatorOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(options);
}

Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;

std::size_t Simulator::size() const { return impl_->frames; }

const Camera& Simulator::camera() const { return impl_->camera; }

SE3 Simulator::T_world_camera(std::size_t index) const {
  return impl_->flight.T_world_camera(static_cast<double>(index) / impl_->options.fps);
}

SimulatedView Simulator::render(std::size_t index, SimulatedParts parts) {
  if (index >= impl_->frames) {
    throw OptionsError("simulator: frame " + std::to_string(index) + " is beyond the end of the flight");
  }
  SimulatedView view;
  view.frame.index = index;
  // In whole nanoseconds, as cameras and recordings give it.
  view.frame.timestamp = seconds_of(nanoseconds_of(static_cast<double>(index) / impl_->options.fps));
  const SE3 pose = T_world_camera(index);
  if (impl_->options.imu) {
    const double since = view.frame.timestamp - 1.0 / impl_->options.fps;
    view.frame.inertial = inertial_samples(impl_->flight, since, view.frame.timestamp, impl_->options.seed);
  }
  view.frame.T_world_camera = pose;
  simulation::Mesh movables;
  impl_->traffic.add_to(movables, view.frame.timestamp, pose);
  impl_->renderer.set_movables(std::move(movables));
  const simulation::Image image = impl_->renderer.draw(pose);
  const auto noise_seed = mix(impl_->options.seed, static_cast<std::uint32_t>(index), 0xca3e7aU);
  view.frame.colour = expose(image.colour, impl_->options.gain, impl_->options.colour_noise, noise_seed);
  view.frame.depth = impl_->measured(image.depth, index);
  if (impl_->options.stereo) view.frame.right = impl_->right_image(pose, index);
  view.frame.labels = image.labels;
  view.instances = image.instances;
  if (parts == SimulatedParts::kBackground) {
    const simulation::Image background = impl_->renderer.without_movables(pose, image);
    view.background_colour =
        expose(background.colour, impl_->options.gain, impl_->options.colour_noise, noise_seed);
    view.background_depth = impl_->measured(background.depth, index);
  }
  return view;
}

std::optional<Frame> SimulatedSource::next() {
  if (index_ >= simulator_.size()) return std::nullopt;
  Frame frame = simulator_.render(index_++).frame;
  if (camera().is_stereo()) frame.depth.release();
  return frame;
}

}  // namespace roslam::simulation
