// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "benchmarks/synthetic.hpp"

namespace roslam::benchmarks {

// Each registers the benchmarks of one stage with Google Benchmark.
void register_feature_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_matching_benchmarks();
void register_pose_benchmarks();
void register_bundle_benchmarks();
void register_place_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_restoration_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_dense_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_inference_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_segmentation_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_sensors_benchmarks();
void register_slam_benchmarks(const std::shared_ptr<RenderedFlight>& flight);
void register_stereo_benchmarks();

}  // namespace roslam::benchmarks
