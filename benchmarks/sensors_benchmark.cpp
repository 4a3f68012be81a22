// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "benchmarks/benchmarks.hpp"
#include "roslam/sensors/depth_registration.hpp"

namespace roslam::benchmarks {

namespace {
// The two cameras of a RealSense D435 at 640x480.
void register_depth(benchmark::State& state, bool with_distortion) {
  Camera depth, colour;
  depth.fx = depth.fy = 390.4;
  depth.cx = 321.0;
  depth.cy = 238.0;
  colour.fx = colour.fy = 613.2;
  if (with_distortion) colour.distortion = {-0.0565, 0.0682, 0.000366, 0.000693, -0.0218};
  const DepthRegistration registration(depth, colour,
                                       SE3(Eigen::Quaterniond::Identity(), {0.0143, 0.0006, 0.0006}));
  cv::Mat image(depth.height, depth.width, CV_32FC1);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      image.at<float>(v, u) =
          u % 80 < 8 ? 0.0F : 2.0F + 0.003F * static_cast<float>(v) + (u / 160 % 2 == 0 ? 1.0F : 0.0F);
  for (auto _ : state) benchmark::DoNotOptimize(registration(image));
}
}  // namespace

void register_sensors_benchmarks() {
  benchmark::RegisterBenchmark("sensors/register_depth_640x480", [](auto& state) {
    register_depth(state, false);
  })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("sensors/register_depth_640x480_distorted", [](auto& state) {
    register_depth(state, true);
  })->Unit(benchmark::kMillisecond);
}

}  // namespace roslam::benchmarks
