// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Camera::distort of many pixels at once, in single precision: within 0.001 pixels of it for images of up to
/// 4000 pixels. Immutable, so safe to use from several threads.
class PixelDistortion {
 public:
  /// In single precision.
  struct Parameters {
    float fx, fy, cx, cy;
    std::array<float, 8> k;  // of Camera::distortion
    float valid;             // square of the radius up to which the model is valid, of normalised coordinates
  };

  /// How far outside the image pixels are put that the lens does not see.
  static constexpr float kFar = 1e6F;

  /// Of a camera that is valid.
  explicit PixelDistortion(const Camera& camera);

  /// Replaces undistorted pixels by those of the raw image. Both coordinates are kFar where the lens model is
  /// not valid; none is beyond kFar.
  void operator()(std::size_t count, float* x, float* y) const;

 private:
  void (*formula_)(const Parameters&, std::size_t, float*, float*);
  Parameters parameters_;
};

}  // namespace roslam
