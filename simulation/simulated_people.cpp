// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include "simulation/simulated_actors.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Appearance of a person; all parts carry the same label and instance.
struct Looks {
  float height = 1.75F;
  Surface top, trousers, shoes, skin, hair;
  bool rucksack = false;
  bool helmet = false;
  Surface bag;
};

Looks looks_of(std::uint32_t seed, std::uint16_t instance, std::uint8_t label) {
  Dice dice(seed);
  const auto part = [&](Material material, const Vector3f& colour) {
    return Surface{
        .material = material, .label = label, .instance = instance, .seed = dice.bits(), .colour = colour};
  };
  const auto dye = [&] {
    const float hue = dice.between(0, 6.28F);
    const float light = dice.between(0.12F, 0.7F);
    const float strength = dice.between(0.05F, 0.35F);
    return Vector3f((light + strength * std::cos(hue)), light + strength * std::cos(hue + 2.1F),
                    light + strength * std::cos(hue + 4.2F))
        .cwiseMax(0.05F)
        .cwiseMin(0.9F)
        .eval();
  };
  Looks looks;
  looks.height = dice.between(1.58F, 1.88F);
  looks.top = part(Material::kCloth, dye());
  const float denim = dice.between(0.1F, 0.35F);
  looks.trousers =
      part(Material::kCloth, dice.chance(0.6F) ? Vector3f(denim * 0.7F, denim * 0.8F, denim * 1.15F)
                                               : Vector3f(denim, denim * 0.93F, denim * 0.8F));
  looks.trousers.seed &= ~7U;  // no pattern
  looks.shoes =
      part(Material::kPlain, dice.chance(0.3F) ? Vector3f(0.8F, 0.8F, 0.8F) : Vector3f(0.12F, 0.1F, 0.09F));
  const float tan = dice.between(0.35F, 1.0F);
  looks.skin = part(Material::kPlain, {0.82F * tan, 0.62F * tan, 0.5F * tan});
  const float dark = dice.between(0.05F, 0.45F);
  looks.hair = part(Material::kBark, {dark, dark * 0.75F, dark * 0.5F});
  looks.rucksack = dice.chance(0.35F);
  looks.bag = part(Material::kCloth, dye());
  return looks;
}

void limb(MeshBuilder& builder, const Vector3f& a, const Vector3f& b, const Vector3f& c, float thick,
          float thin) {
  builder.tube(a, b, thick, 0.8F * thick, 8);
  builder.tube(b, c, 0.82F * thick, thin, 8);
}

void add_trunk(MeshBuilder& builder, const Looks& looks, const Vector3f& hip, const Vector3f& neck, float h) {
  const Vector3f up = (neck - hip).normalized();
  builder.use(looks.trousers);
  builder.tube(hip - 0.05F * h * up, hip + 0.06F * h * up, 0.085F * h, 0.09F * h, 12, 0.75F);
  builder.use(looks.top);
  const Vector3f chest = hip + 0.72F * (neck - hip);
  builder.tube(hip + 0.02F * h * up, chest, 0.088F * h, 0.105F * h, 12, 0.66F);
  builder.tube(chest, neck - 0.012F * h * up, 0.105F * h, 0.045F * h, 12, 0.7F);
  builder.use(looks.skin);
  builder.tube(neck - 0.03F * h * up, neck + 0.05F * h * up, 0.034F * h, 0.032F * h, 8);
  const Vector3f head = neck + 0.088F * h * up + Vector3f(0.012F * h, 0, 0);
  builder.ellipsoid(head, {0.054F * h, 0.044F * h, 0.066F * h}, 9, 12);
  builder.ellipsoid(head + Vector3f(0.055F * h, 0, -0.008F * h), {0.012F * h, 0.008F * h, 0.014F * h}, 4, 6);
  builder.use(looks.hair);
  builder.ellipsoid(head + Vector3f(-0.012F * h, 0, 0.018F * h), {0.056F * h, 0.049F * h, 0.06F * h}, 7, 12);
  if (looks.helmet) {
    builder.use(looks.bag);
    builder.ellipsoid(head + Vector3f(0, 0, 0.035F * h), {0.075F * h, 0.058F * h, 0.045F * h}, 6, 12);
  }
  if (looks.rucksack) {
    builder.use(looks.bag);
    const Vector3f back = hip + 0.55F * (neck - hip) - Vector3f(0.1F * h, 0, 0);
    builder.ellipsoid(back, {0.065F * h, 0.09F * h, 0.13F * h}, 7, 10);
  }
}

// A ring of short tubes in the plane of the bicycle.
void add_wheel(MeshBuilder& builder, float x, float radius, float turn) {
  const int parts = builder.detail() > 0.5F ? 18 : 9;
  const auto rim = [&](float r, float angle) {
    return Vector3f(x + r * std::cos(angle), 0, radius + r * std::sin(angle));
  };
  const float step = 2 * kPi / static_cast<float>(parts);
  for (int i = 0; i < parts; ++i) {
    const float a = 2 * kPi * static_cast<float>(i) / static_cast<float>(parts);
    builder.tube(rim(radius - 0.015F, a), rim(radius - 0.015F, a + step), 0.022F, 0.022F, 5);
    if (i % 3 == 0) builder.tube(rim(0.0F, a - turn), rim(radius - 0.02F, a - turn), 0.006F, 0.006F, 3);
  }
}

void add_bicycle(MeshBuilder& builder, const Surface& frame, const Surface& black, float turn) {
  builder.use(black);
  add_wheel(builder, -0.52F, 0.34F, turn);
  add_wheel(builder, 0.54F, 0.34F, turn);
  builder.ellipsoid({-0.2F, 0, 0.98F}, {0.13F, 0.07F, 0.035F}, 5, 9);              // saddle
  builder.tube({0.36F, -0.27F, 1.04F}, {0.36F, 0.27F, 1.04F}, 0.016F, 0.016F, 6);  // handlebar
  builder.use(frame);
  const Vector3f crank(-0.05F, 0, 0.3F);
  const Vector3f seat(-0.18F, 0, 0.86F);
  const Vector3f steer(0.38F, 0, 0.86F);
  builder.tube(crank, seat, 0.02F, 0.02F, 6);
  builder.tube(seat, steer, 0.02F, 0.02F, 6);
  builder.tube(crank, steer, 0.024F, 0.024F, 6);
  builder.tube(crank, {-0.52F, 0, 0.34F}, 0.014F, 0.014F, 5);
  builder.tube(seat, {-0.52F, 0, 0.34F}, 0.013F, 0.013F, 5);
  builder.tube({0.36F, 0, 1.03F}, {0.54F, 0, 0.34F}, 0.019F, 0.016F, 6);
  builder.tube(seat, {-0.2F, 0, 0.97F}, 0.015F, 0.015F, 5);
}

// The knee of a leg of two equal parts from hip to foot, bent forwards.
Vector3f knee_between(const Vector3f& hip, const Vector3f& foot, float bone) {
  const Vector3f middle = 0.5F * (hip + foot);
  const float half = 0.5F * (foot - hip).norm();
  const Vector3f down = (foot - hip).normalized();
  const Vector3f forward = Vector3f::UnitY().cross(down);  // at right angles to the leg, within its plane
  const float bend = std::sqrt(std::max(bone * bone - half * half, 0.0F));
  return middle + bend * (forward.x() >= 0 ? forward : Vector3f(-forward));
}

}  // namespace

void add_pedestrian(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed) {
  const Looks looks = looks_of(seed, instance, kPersonLabel);
  const float h = looks.height;
  const float phase = 2 * kPi * stance.way / (0.8F * h);
  builder.place(stance.foot, stance.yaw);
  const float bob = 0.012F * h * std::cos(2 * phase);
  const Vector3f hip(0, 0, 0.515F * h + bob);
  const Vector3f neck(0.015F * h, 0, 0.83F * h + bob);
  for (const float side : {-1.0F, 1.0F}) {
    const float swing = side * std::sin(phase);
    const float lift =
        std::max(0.0F, side * std::cos(phase));  // the leg that comes forward leaves the ground
    const Vector3f joint = hip + Vector3f(0, side * 0.052F * h, -0.02F * h);
    const Vector3f ankle(0.19F * h * swing, side * 0.05F * h, 0.045F * h + 0.07F * h * lift);
    builder.use(looks.trousers);
    limb(builder, joint, knee_between(joint, ankle, 0.236F * h), ankle, 0.05F * h, 0.03F * h);
    builder.use(looks.shoes);
    const Vector3f toe = ankle + Vector3f(0.1F * h, 0, -0.022F * h - 0.02F * h * lift);
    builder.tube(ankle - Vector3f(0.035F * h, 0, 0.022F * h), toe, 0.026F * h, 0.02F * h, 7);
    const float arm = -0.55F * swing;
    const Vector3f shoulder = neck + Vector3f(-0.01F * h, side * 0.098F * h, -0.042F * h);
    const Vector3f elbow = shoulder + 0.17F * h * Vector3f(std::sin(arm), side * 0.1F, -std::cos(arm));
    const float bend = arm + 0.35F;
    const Vector3f hand = elbow + 0.16F * h * Vector3f(std::sin(bend), 0, -std::cos(bend));
    builder.use(looks.top);
    limb(builder, shoulder, elbow, hand, 0.03F * h, 0.019F * h);
    if (builder.coarse()) continue;
    builder.ellipsoid(shoulder, {0.032F * h, 0.03F * h, 0.032F * h}, 6, 8);
    builder.use(looks.skin);
    builder.ellipsoid(hand, {0.024F * h, 0.017F * h, 0.034F * h}, 5, 7);
  }
  add_trunk(builder, looks, hip, neck, h);
}

void add_cyclist(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed) {
  Looks looks = looks_of(seed, instance, kRiderLabel);
  looks.helmet = (seed & 3U) != 0;
  const float h = looks.height;
  builder.place(stance.foot, stance.yaw);
  Surface frame{.material = Material::kPlain,
                .label = kBicycleLabel,
                .instance = instance,
                .seed = seed,
                .colour = looks.bag.colour};
  Surface black = frame;
  black.colour = {0.08F, 0.08F, 0.08F};
  add_bicycle(builder, frame, black, stance.way / 0.34F);
  const Vector3f hip(-0.2F, 0, 1.03F);
  const Vector3f neck = hip + 0.32F * h * Vector3f(0.5F, 0, 0.866F);
  const float pedal = stance.way / 0.34F / 2.4F;
  for (const float side : {-1.0F, 1.0F}) {
    const float angle = pedal + (side > 0 ? kPi : 0.0F);
    const Vector3f foot(-0.05F + 0.17F * std::cos(-angle), side * 0.11F, 0.33F + 0.17F * std::sin(-angle));
    const Vector3f joint = hip + Vector3f(0.03F, side * 0.055F * h, -0.02F);
    builder.use(looks.trousers);
    limb(builder, joint, knee_between(joint, foot, 0.25F * h), foot, 0.05F * h, 0.03F * h);
    builder.use(looks.shoes);
    builder.tube(foot - Vector3f(0.06F, 0, 0), foot + Vector3f(0.14F, 0, -0.01F), 0.045F, 0.03F, 7);
    const Vector3f shoulder = neck + Vector3f(0, side * 0.11F * h, -0.03F * h);
    const Vector3f hand(0.36F, side * 0.24F, 1.07F);
    builder.use(looks.top);
    limb(builder, shoulder, 0.5F * (shoulder + hand) + Vector3f(-0.03F, side * 0.04F, -0.06F), hand,
         0.034F * h, 0.022F * h);
    builder.use(looks.skin);
    builder.ellipsoid(hand, {0.04F, 0.035F, 0.04F}, 5, 7);
  }
  add_trunk(builder, looks, hip, neck, h);
}

}  // namespace roslam::simulation
