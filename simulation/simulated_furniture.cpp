// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include "simulation/simulated_city.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Single leaves around a ball of foliage, which give the crown a ragged outline.
void add_leaves(MeshBuilder& builder, const Vector3f& centre, float radius, int count, Dice& dice) {
  for (int i = 0; i < count; ++i) {
    const float z = dice.between(-0.8F, 1.0F);
    const float turn = dice.between(0, 2 * kPi);
    const float r = std::sqrt(1 - z * z);
    const Vector3f out(r * std::cos(turn), r * std::sin(turn), z);
    const Vector3f side = out.cross(Vector3f(dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1)));
    const float size = dice.between(0.07F, 0.16F);
    const Vector3f at = centre + radius * dice.between(0.92F, 1.12F) * out;
    const Vector3f a = size * side.normalized();
    const Vector3f b = size * (0.8F * out + 0.6F * side.cross(out)).normalized();
    const Vector2f uv(dice.between(0, 9), dice.between(0, 9));
    builder.triangle(at - a, at + a, at + b, uv, uv + Vector2f(0.2F, 0), uv + Vector2f(0.1F, 0.2F));
  }
}

}  // namespace

void add_tree(MeshBuilder& builder, const Vector3f& foot, std::uint32_t seed) {
  Dice dice(seed);
  builder.place(foot, dice.between(0, 2 * kPi));
  const float clear = dice.between(2.3F, 3.1F);
  const float girth = dice.between(0.1F, 0.17F);
  builder.use({.material = Material::kBark, .label = kVegetationLabel, .seed = seed});
  const Vector3f bend(dice.between(-0.1F, 0.1F), dice.between(-0.1F, 0.1F), clear);
  builder.tube({0, 0, -0.05F}, {0, 0, 0.3F}, girth * 1.6F, girth, 9);
  builder.tube({0, 0, 0.25F}, bend, girth, girth * 0.8F, 9);
  const float autumn = dice.between(0, 1);
  const Vector3f green(0.2F + 0.2F * autumn * autumn, 0.36F - 0.03F * autumn, 0.1F);
  const int balls = 7 + static_cast<int>(dice.below(4));
  const float spread = dice.between(0.9F, 1.25F);
  for (int i = 0; i < balls; ++i) {
    const float turn = 2.4F * static_cast<float>(i) + dice.between(-0.4F, 0.4F);
    const float level = static_cast<float>(i) / static_cast<float>(balls);
    const float reach = i == balls - 1 ? 0.0F : spread * dice.between(0.5F, 0.95F) * (1.1F - 0.6F * level);
    const Vector3f centre = bend + Vector3f(reach * std::cos(turn), reach * std::sin(turn),
                                            0.4F + 2.4F * level + dice.between(0, 0.4F));
    builder.use({.material = Material::kBark, .label = kVegetationLabel, .seed = seed});
    builder.tube(bend - Vector3f(0, 0, 0.2F), centre, girth * 0.5F, girth * 0.2F, 5);
    builder.use(
        {.material = Material::kFoliage, .label = kVegetationLabel, .seed = dice.bits(), .colour = green});
    const float radius = dice.between(0.6F, 0.95F);
    builder.ellipsoid(centre, {radius, radius, 0.8F * radius}, 9, 14, 0.22F, dice.bits());
    add_leaves(builder, centre, radius, 90, dice);
  }
}

void add_lamp(MeshBuilder& builder, const Vector3f& foot, float yaw) {
  builder.place(foot, yaw);
  const Vector3f grey(0.27F, 0.29F, 0.3F);
  builder.use({.material = Material::kPlain, .label = kPoleLabel, .seed = 3, .colour = grey});
  builder.tube({0, 0, 0}, {0, 0, 0.9F}, 0.1F, 0.09F, 10);
  builder.tube({0, 0, 0.9F}, {0, 0, 6.2F}, 0.06F, 0.045F, 8);
  builder.tube({0, 0, 6.15F}, {1.5F, 0, 6.5F}, 0.035F, 0.03F, 6);
  builder.use({.material = Material::kPlain, .label = kPoleLabel, .seed = 4, .colour = {0.8F, 0.8F, 0.75F}});
  builder.box({1.35F, -0.13F, 6.43F}, {2.0F, 0.13F, 6.55F});
}

void add_sign(MeshBuilder& builder, const Vector3f& foot, float yaw, std::uint32_t seed) {
  builder.place(foot, yaw);
  Dice dice(seed);
  builder.use(
      {.material = Material::kPlain, .label = kPoleLabel, .seed = seed, .colour = {0.55F, 0.56F, 0.57F}});
  builder.tube({0, 0, 0}, {0, 0, 2.9F}, 0.035F, 0.035F, 8);
  const float half = dice.between(0.28F, 0.36F);
  const float z = 2.5F;
  builder.use(
      {.material = Material::kSign, .label = kSignLabel, .seed = dice.bits(), .size = {2 * half, 2 * half}});
  const float x = -0.05F;
  builder.quad({x, half, z - half}, {x, -half, z - half}, {x, -half, z + half}, {x, half, z + half});
  builder.use(
      {.material = Material::kPlain, .label = kSignLabel, .seed = seed, .colour = {0.45F, 0.46F, 0.47F}});
  builder.quad({x + 0.02F, -half, z - half}, {x + 0.02F, half, z - half}, {x + 0.02F, half, z + half},
               {x + 0.02F, -half, z + half});
}

void add_street_furniture(MeshBuilder& builder, const Vector3f& foot, float yaw, std::uint32_t seed) {
  builder.place(foot, yaw);
  Dice dice(seed);
  switch (dice.below(4)) {
    case 0:  // litter bin
      builder.use(
          {.material = Material::kPlain, .label = kVoidLabel, .seed = seed, .colour = {0.18F, 0.3F, 0.22F}});
      builder.tube({0, 0, 0.05F}, {0, 0, 0.85F}, 0.2F, 0.25F, 12);
      builder.use(
          {.material = Material::kPlain, .label = kVoidLabel, .seed = seed, .colour = {0.1F, 0.1F, 0.1F}});
      builder.tube({0, 0, 0.86F}, {0, 0, 0.93F}, 0.27F, 0.2F, 12);
      break;
    case 1:  // bench
      builder.use(
          {.material = Material::kBark, .label = kVoidLabel, .seed = seed, .colour = {0.5F, 0.34F, 0.2F}});
      for (int i = 0; i < 3; ++i) {
        const float x = 0.16F * static_cast<float>(i) - 0.2F;
        builder.box({x, -0.9F, 0.42F}, {x + 0.12F, 0.9F, 0.46F});
      }
      builder.box({0.24F, -0.9F, 0.6F}, {0.27F, 0.9F, 0.72F});
      builder.box({0.25F, -0.9F, 0.77F}, {0.28F, 0.9F, 0.89F});
      builder.use(
          {.material = Material::kPlain, .label = kVoidLabel, .seed = seed, .colour = {0.15F, 0.15F, 0.16F}});
      for (const float y : {-0.75F, 0.72F}) builder.box({-0.2F, y, 0}, {0.27F, y + 0.05F, 0.42F});
      for (const float y : {-0.75F, 0.72F}) builder.box({0.2F, y, 0.4F}, {0.25F, y + 0.05F, 0.88F});
      break;
    case 2:  // flower tub
      builder.use(
          {.material = Material::kKerb, .label = kVoidLabel, .seed = seed, .colour = {0.6F, 0.55F, 0.5F}});
      builder.box({-0.3F, -0.6F, 0}, {0.3F, 0.6F, 0.45F});
      builder.use({.material = Material::kFoliage,
                   .label = kVegetationLabel,
                   .seed = dice.bits(),
                   .colour = {0.26F, 0.42F, 0.14F}});
      for (int i = 0; i < 3; ++i) {
        const Vector3f centre(0, 0.4F * static_cast<float>(i) - 0.4F, 0.55F);
        builder.ellipsoid(centre, {0.27F, 0.25F, 0.28F}, 7, 10, 0.25F, dice.bits());
        add_leaves(builder, centre, 0.27F, 25, dice);
      }
      break;
    default:  // bollards
      builder.use(
          {.material = Material::kPlain, .label = kPoleLabel, .seed = seed, .colour = {0.2F, 0.21F, 0.23F}});
      for (int i = 0; i < 3; ++i) {
        const float y = 1.1F * static_cast<float>(i) - 1.1F;
        builder.tube({0, y, 0}, {0, y, 0.85F}, 0.06F, 0.05F, 9);
        builder.ellipsoid({0, y, 0.87F}, {0.07F, 0.07F, 0.07F}, 5, 9);
      }
      break;
  }
}

}  // namespace roslam::simulation
