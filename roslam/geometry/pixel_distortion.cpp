// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/pixel_distortion.hpp"

#include <algorithm>
#include <cmath>

#include "roslam/common/target_clones.hpp"
#include "roslam/geometry/lens.hpp"

namespace roslam {

namespace {
// To where the formula of a lens moves a point.
struct Moved {
  float x, y;
};

// Of a number that is not negative, within 1e-7: the polynomial of Abramowitz and Stegun, Handbook of
// Mathematical Functions, 4.4.49. std::atan is not vectorised.
[[gnu::always_inline]] inline float arc_tangent(float value) {
  const float t = value > 1.0F ? 1.0F / value : value, s = t * t;
  const float high = -0.0752896400F + s * (0.0429096138F + s * (-0.0161657367F + s * 0.0028662257F));
  const float low = 0.1999355085F + s * (-0.1420889944F + s * (0.1065626393F + s * high));
  const float sum = 1.0F + s * (-0.3333314528F + s * low);
  constexpr float kRightAngle = 1.57079633F;
  return value > 1.0F ? kRightAngle - t * sum : t * sum;
}

// The formulas of Lens::distort.
using Coefficients = std::array<float, 8>;

[[gnu::always_inline]] inline Moved scaled(float x, float y, float r2, float scale, const Coefficients& k) {
  const float xy = 2.0F * x * y;
  return {x * scale + k[2] * xy + k[3] * (r2 + 2.0F * x * x),
          y * scale + k[2] * (r2 + 2.0F * y * y) + k[3] * xy};
}

[[gnu::always_inline]] inline Moved pinhole(float x, float y, float r2, const Coefficients& k) {
  return scaled(x, y, r2, 1.0F + r2 * (k[0] + r2 * (k[1] + r2 * k[4])), k);
}

[[gnu::always_inline]] inline Moved rational(float x, float y, float r2, const Coefficients& k) {
  const float scale =
      (1.0F + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1.0F + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  return scaled(x, y, r2, scale, k);
}

[[gnu::always_inline]] inline Moved fisheye(float x, float y, float r2, const Coefficients& k) {
  constexpr float kAxis = 1e-12F;  // where the scale is 1
  const float radius = std::sqrt(std::max(kAxis, r2)), angle = arc_tangent(radius), s = angle * angle;
  const float scale = angle * (1.0F + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))) / radius;
  return {x * scale, y * scale};
}

// The limits have the constant first, as NaN then becomes the constant.
template <Moved (*kFormula)(float, float, float, const Coefficients&)>
[[gnu::always_inline]] inline void distort(PixelDistortion::Parameters lens, std::size_t count, float* x,
                                           float* y) {
  constexpr float kFar = PixelDistortion::kFar;
  const float per_fx = 1.0F / lens.fx, per_fy = 1.0F / lens.fy;
  for (std::size_t i = 0; i < count; ++i) {
    const float from_x = (x[i] - lens.cx) * per_fx, from_y = (y[i] - lens.cy) * per_fy;
    const float r2 = from_x * from_x + from_y * from_y;
    const Moved to = kFormula(from_x, from_y, r2, lens.k);
    const float to_x = std::min(kFar, std::max(-kFar, to.x * lens.fx + lens.cx));
    const float to_y = std::min(kFar, std::max(-kFar, to.y * lens.fy + lens.cy));
    x[i] = r2 <= lens.valid ? to_x : kFar;
    y[i] = r2 <= lens.valid ? to_y : kFar;
  }
}

ROSLAM_TARGET_CLONES("avx2")
void distort_pinhole(const PixelDistortion::Parameters& lens, std::size_t count, float* x, float* y) {
  distort<pinhole>(lens, count, x, y);
}

ROSLAM_TARGET_CLONES("avx2")
void distort_rational(const PixelDistortion::Parameters& lens, std::size_t count, float* x, float* y) {
  distort<rational>(lens, count, x, y);
}

ROSLAM_TARGET_CLONES("avx2")
void distort_fisheye(const PixelDistortion::Parameters& lens, std::size_t count, float* x, float* y) {
  distort<fisheye>(lens, count, x, y);
}

auto formula_of(const Camera& camera) {
  return camera.model == LensModel::kFisheye ? distort_fisheye
         : camera.is_rational()              ? distort_rational
                                             : distort_pinhole;
}
}  // namespace

PixelDistortion::PixelDistortion(const Camera& camera)
    : formula_(formula_of(camera)),
      parameters_{static_cast<float>(camera.fx),
                  static_cast<float>(camera.fy),
                  static_cast<float>(camera.cx),
                  static_cast<float>(camera.cy),
                  {},
                  0.0F} {
  std::transform(camera.distortion.begin(), camera.distortion.end(), parameters_.k.begin(),
                 [](double k) { return static_cast<float>(k); });
  const double radius = Lens(camera).valid_radius();
  parameters_.valid = static_cast<float>(std::min(radius * radius, 1e30));
}

void PixelDistortion::operator()(std::size_t count, float* x, float* y) const {
  formula_(parameters_, count, x, y);
}

}  // namespace roslam
