// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "simulation/simulated_actors.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

/// Side view of a car, metres from its middle and from the ground.
struct CarShape {
  float length, width, height, belt, bonnet;
  float screen_foot, screen_top, rear_top, rear_foot;  ///< x of the corners of the cabin
};

constexpr CarShape kShapes[] = {
    {4.5F, 1.78F, 1.45F, 0.95F, 0.80F, 0.95F, 0.20F, -1.05F, -1.70F},   // saloon
    {4.0F, 1.74F, 1.48F, 0.95F, 0.82F, 0.85F, 0.15F, -1.55F, -1.92F},   // hatchback
    {4.6F, 1.80F, 1.50F, 0.95F, 0.82F, 0.90F, 0.20F, -1.80F, -2.15F},   // estate
    {4.5F, 1.86F, 1.70F, 1.08F, 0.98F, 1.00F, 0.35F, -1.75F, -2.12F},   // off-roader
    {5.2F, 1.95F, 2.15F, 1.20F, 1.05F, 1.75F, 1.15F, -2.45F, -2.52F}};  // van

void add_hull(MeshBuilder& builder, const CarShape& car) {
  struct Station {
    float x, width, bottom, top;
  };
  const float end = car.length / 2;
  const Station stations[] = {{-end, 0.86F, 0.38F, car.belt - 0.22F},
                              {-end + 0.06F, 0.94F, 0.30F, car.belt - 0.08F},
                              {-end + 0.3F, 1.0F, 0.24F, car.belt},
                              {car.screen_foot - 0.3F, 1.0F, 0.22F, car.belt},
                              {car.screen_foot + 0.1F, 1.0F, 0.22F, car.belt - 0.03F},
                              {end - 0.45F, 0.97F, 0.24F, car.bonnet},
                              {end - 0.12F, 0.91F, 0.28F, car.bonnet - 0.12F},
                              {end, 0.8F, 0.36F, car.bonnet - 0.26F}};
  std::vector<std::vector<Vector3f>> rings;
  for (const Station& s : stations) {
    const float w = s.width * car.width / 2;
    const float waist = 0.55F * s.bottom + 0.45F * s.top;
    rings.push_back({{s.x, -0.93F * w, s.bottom},
                     {s.x, -w, waist},
                     {s.x, -0.97F * w, s.top - 0.12F},
                     {s.x, -0.86F * w, s.top - 0.02F},
                     {s.x, -0.4F * w, s.top + 0.02F},
                     {s.x, 0.4F * w, s.top + 0.02F},
                     {s.x, 0.86F * w, s.top - 0.02F},
                     {s.x, 0.97F * w, s.top - 0.12F},
                     {s.x, w, waist},
                     {s.x, 0.93F * w, s.bottom}});
  }
  builder.loft(rings);
  for (const auto* ring : {&rings.front(), &rings.back()}) {
    for (std::size_t i = 1; i + 2 < ring->size(); ++i) {
      builder.triangle((*ring)[0], (*ring)[i], (*ring)[i + 1], {9, 0.5F}, {9, 0.5F}, {9, 0.5F});
    }
    builder.triangle((*ring)[0], (*ring)[ring->size() - 2], ring->back(), {9, 0.5F}, {9, 0.5F}, {9, 0.5F});
  }
}

void add_cabin(MeshBuilder& builder, const CarShape& car, const Surface& paint, std::uint32_t seed) {
  const float low = car.belt - 0.01F;
  const float w0 = car.width / 2 * 0.88F;
  const float w1 = car.width / 2 * (car.height > 2 ? 0.82F : 0.68F);
  const Vector3f base[4] = {{car.rear_foot, -w0, low},
                            {car.screen_foot, -w0, low},
                            {car.screen_foot, w0, low},
                            {car.rear_foot, w0, low}};
  const float h = car.height - 0.05F;
  const Vector3f top[4] = {
      {car.rear_top, -w1, h}, {car.screen_top, -w1, h}, {car.screen_top, w1, h}, {car.rear_top, w1, h}};
  for (int i = 0; i < 4; ++i) {
    const int j = (i + 1) % 4;
    const bool side = i % 2 == 0;
    const bool blind = car.height > 2 && i != 1;  // a van has panels in place of the windows
    builder.use(paint);
    builder.quad(base[i], base[j], top[j], top[i], {8, 0.7F}, {8, 0.7F});
    const auto at = [&](float u, float v) {
      const Vector3f below = base[i] + u * (base[j] - base[i]);
      const Vector3f above = top[i] + u * (top[j] - top[i]);
      const Vector3f out = (base[j] - base[i]).cross(top[i] - base[i]).normalized();
      return Vector3f(below + v * (above - below) + 0.012F * out);
    };
    builder.use({.material = Material::kGlass, .label = kCarLabel, .instance = paint.instance, .seed = seed});
    if (side) {
      const float from = blind ? 0.72F : 0.06F;
      for (const Vector2f& pane : {Vector2f(from, 0.5F), Vector2f(0.53F, 0.95F)}) {
        if (pane.x() > pane.y()) continue;
        const Vector2f fit = i == 0 ? pane : Vector2f(1 - pane.y(), 1 - pane.x());
        builder.quad(at(fit.x(), 0.1F), at(fit.y(), 0.1F), at(fit.y(), 0.88F), at(fit.x(), 0.88F));
      }
      if (blind)
        builder.quad(at(i == 0 ? 0.74F : 0.05F, 0.3F), at(i == 0 ? 0.95F : 0.26F, 0.3F),
                     at(i == 0 ? 0.95F : 0.26F, 0.85F), at(i == 0 ? 0.74F : 0.05F, 0.85F));
    } else {
      builder.quad(at(0.06F, 0.06F), at(0.94F, 0.06F), at(0.94F, 0.92F), at(0.06F, 0.92F));
    }
  }
  builder.use(paint);
  const Vector3f crown(0, 0, 0.05F);
  const Vector3f inset(0.12F, 0.14F, 0);
  const Vector3f roof[4] = {top[0] + crown + inset, top[1] + crown + inset.cwiseProduct(Vector3f(-1, 1, 0)),
                            top[2] + crown - inset, top[3] + crown + inset.cwiseProduct(Vector3f(1, -1, 0))};
  builder.quad(roof[0], roof[1], roof[2], roof[3], {8, 0.7F}, {8, 0.7F});
  for (int i = 0; i < 4; ++i) {
    const int j = (i + 1) % 4;
    builder.quad(top[i], top[j], roof[j], roof[i], {8, 0.7F}, {8, 0.7F});
  }
}

void add_trim(MeshBuilder& builder, const CarShape& car, const Surface& paint) {
  const float end = car.length / 2;
  const float half = car.width / 2;
  const auto part = [&](const Vector3f& colour) {
    builder.use({.material = Material::kPlain,
                 .label = kCarLabel,
                 .instance = paint.instance,
                 .seed = 11,
                 .colour = colour});
  };
  part({0.75F, 0.08F, 0.07F});  // rear lights
  const float tail = car.belt - 0.32F;
  for (const float y : {-half * 0.84F, half * 0.84F - 0.3F}) {
    builder.box({-end - 0.015F, y, tail}, {-end + 0.1F, y + 0.3F, tail + 0.15F});
  }
  part({0.92F, 0.93F, 0.95F});  // headlights, and the number plates
  const float head = car.bonnet - 0.32F;
  for (const float y : {-half * 0.8F, half * 0.8F - 0.34F}) {
    builder.box({end - 0.14F, y, head}, {end + 0.012F, y + 0.34F, head + 0.13F});
  }
  builder.box({-end - 0.02F, -0.26F, tail - 0.2F}, {-end, 0.26F, tail - 0.08F});
  builder.box({end, -0.26F, 0.42F}, {end + 0.02F, 0.26F, 0.53F});
  part({0.07F, 0.07F, 0.08F});  // grille, bumpers, mirrors
  builder.box({end - 0.1F, -0.4F, head + 0.01F}, {end + 0.01F, 0.4F, head + 0.1F});
  builder.box({-end - 0.03F, -half * 0.8F, 0.32F}, {-end + 0.2F, half * 0.8F, 0.44F});
  builder.box({end - 0.2F, -half * 0.75F, 0.29F}, {end + 0.03F, half * 0.75F, 0.38F});
  for (const float side : {-1.0F, 1.0F}) {
    const float y = side * (half + 0.08F);
    builder.box({car.screen_foot - 0.35F, y - 0.09F, car.belt},
                {car.screen_foot - 0.2F, y + 0.09F, car.belt + 0.14F});
  }
}

void add_wheels(MeshBuilder& builder, const CarShape& car, const Surface& paint) {
  constexpr float kRadius = 0.32F;
  for (const float x : {-0.31F * car.length, 0.3F * car.length}) {
    for (const float side : {-1.0F, 1.0F}) {
      const float y = side * (car.width / 2 - 0.02F);
      builder.use({.material = Material::kPlain,
                   .label = kCarLabel,
                   .instance = paint.instance,
                   .seed = 2,
                   .colour = {0.06F, 0.06F, 0.065F}});
      builder.tube({x, y - side * 0.22F, kRadius}, {x, y, kRadius}, kRadius, kRadius, 18);
      builder.use({.material = Material::kPlain,
                   .label = kCarLabel,
                   .instance = paint.instance,
                   .seed = 5,
                   .colour = {0.55F, 0.56F, 0.58F}});
      builder.tube({x, y - side * 0.05F, kRadius}, {x, y + side * 0.075F, kRadius}, 0.2F, 0.19F, 12);
      builder.use({.material = Material::kPlain,
                   .label = kCarLabel,
                   .instance = paint.instance,
                   .seed = 2,
                   .colour = {0.1F, 0.1F, 0.1F}});
      for (int spoke = 0; spoke < 5 && builder.detail() > 0.55F; ++spoke) {
        const float angle = 1.2566F * static_cast<float>(spoke) + x;
        const Vector3f hole(x + 0.11F * std::cos(angle), y + side * 0.1F, kRadius + 0.11F * std::sin(angle));
        builder.ellipsoid(hole, {0.045F, 0.035F, 0.045F}, 4, 6);
      }
    }
  }
}

}  // namespace

void add_car(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed) {
  Dice dice(seed);
  const auto kind = dice.below(17);
  const CarShape& car = kShapes[kind == 16 ? 4 : kind % 4];
  constexpr int kColours = 9;
  const Vector3f colours[kColours] = {{0.75F, 0.76F, 0.77F}, {0.11F, 0.12F, 0.13F}, {0.86F, 0.86F, 0.85F},
                                      {0.55F, 0.09F, 0.08F}, {0.12F, 0.2F, 0.42F},  {0.38F, 0.4F, 0.42F},
                                      {0.18F, 0.3F, 0.24F},  {0.62F, 0.55F, 0.42F}, {0.3F, 0.45F, 0.6F}};
  Surface paint{.material = Material::kPaint,
                .label = kCarLabel,
                .instance = instance,
                .seed = seed,
                .colour = colours[dice.below(kColours)],
                .size = {car.length, car.belt}};
  builder.place(stance.foot, stance.yaw);
  builder.use(paint);
  add_hull(builder, car);
  add_cabin(builder, car, paint, seed);
  add_trim(builder, car, paint);
  add_wheels(builder, car, paint);
}

}  // namespace roslam::simulation
