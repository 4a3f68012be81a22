// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <numbers>

#include "roslam/geometry/camera.hpp"

namespace roslam {

namespace {
std::map<std::string, Camera, std::less<>> presets() {
  const auto make = [](double fx, double fy, double cx, double cy, const std::array<double, 8>& distortion,
                       double units, DepthNoise noise) {
    return Camera{
        640, 480, fx, fy, cx, cy, LensModel::kPinhole, distortion, units, 30.0, noise, {}, forward_camera()};
  };
  // TUM: calibration published with the RGB-D benchmark. RealSense: typical factory values of the colour
  // stream at 640x480 with depth aligned to colour; calibrate your own camera for the best accuracy. Depth
  // noise: as DepthNoiseEstimator finds it in recordings of these cameras; d455: of its baseline of 95 mm.
  constexpr DepthNoise kKinect{0.0005, 0.0026};
  std::map<std::string, Camera, std::less<>> all{
      {"tum-fr1",
       make(517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}, 5000, kKinect)},
      {"tum-fr2",
       make(520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}, 5000, kKinect)},
      {"tum-fr3", make(535.4, 539.2, 320.1, 247.6, {}, 5000, kKinect)},
      // Bonn RGB-D Dynamic: as published with the data set.
      {"bonn", make(542.822841, 542.576870, 315.593520, 237.756098,
                    {0.039903, -0.099343, -0.000730, -0.000144, 0.0}, 5000, kKinect)},
      {"7scenes", make(525.0, 525.0, 320.0, 240.0, {}, 1000, {0.0007, 0.0015})},
      {"d435", make(615.0, 615.0, 320.0, 240.0, {}, 1000, {0.0005, 0.0066})},
      {"d455", make(385.0, 385.0, 320.0, 240.0, {}, 1000, {0.0005, 0.0022})},
      {"simulated", make(385.0, 385.0, 319.5, 239.5, {}, 1000, {0.0005, 0.0022})},
  };
  all.at("simulated").T_body_camera = mounted_camera({0, 0, 0, 0, 0.26 * 180.0 / std::numbers::pi, 0});
  return all;
}
}  // namespace

std::vector<std::string> camera_preset_names() {
  std::vector<std::string> names;
  for (const auto& [name, camera] : presets()) names.push_back(name);
  return names;
}

std::optional<Camera> camera_preset(std::string_view name) {
  const auto all = presets();
  const auto found = all.find(name);
  return found == all.end() ? std::nullopt : std::make_optional(found->second);
}

}  // namespace roslam
