// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "roslam/sensors/frame_source.hpp"
#include "simulation/simulated_options.hpp"

namespace roslam::simulation {

/// A frame of the simulated flight with its ground truth.
struct SimulatedView {
  Frame frame;        ///< colour, right, depth, labels (Cityscapes train ids, 255 = none of them) and pose
  cv::Mat instances;  ///< CV_16UC1, number of the moving object; 0 = none moves there
  cv::Mat background_colour;  ///< CV_8UC3, the same view without movable objects, parked cars included
  cv::Mat background_depth;   ///< CV_32FC1, its depth, with noise as the depth of the frame
};

enum class SimulatedParts {
  kFrame,       ///< background left empty, which saves rendering it
  kBackground,  ///< frame and background
};

/// A drone's flight through a street with houses, trees, cars and people, with full ground truth. A frame is
/// a function of options and index alone: the same bytes whatever was rendered before.
class Simulator {
 public:
  /// Throws OptionsError.
  explicit Simulator(const SimulatorOptions& options);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  std::size_t size() const;  ///< frames
  const Camera& camera() const;
  SE3 T_world_camera(std::size_t index) const;  ///< world z up, metres

  /// Renders a frame. Not thread-safe. Throws OptionsError for an index beyond the end.
  SimulatedView render(std::size_t index, SimulatedParts parts = SimulatedParts::kFrame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The simulated flight as a source of frames.
class SimulatedSource : public FrameSource {
 public:
  explicit SimulatedSource(const SimulatorOptions& options) : simulator_(options) {}

  std::optional<Frame> next() override;
  const Camera& camera() const override { return simulator_.camera(); }
  std::optional<std::size_t> size() const override { return simulator_.size(); }

 private:
  Simulator simulator_;
  std::size_t index_ = 0;
};

}  // namespace roslam::simulation
