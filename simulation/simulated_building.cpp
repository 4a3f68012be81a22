// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "simulation/simulated_city.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

// One wall: its lower left corner as seen from the street, the direction along it, and the direction out of
// it.
struct Wall {
  Vector3f origin;
  Vector3f along;
  Vector3f out;
  float width;

  Vector3f at(float u, float v, float w) const {
    return origin + u * along + w * out + v * Vector3f::UnitZ();
  }
};

// A box that sticks out of the wall: from (u0, v0) to (u1, v1) on it, w metres thick.
void add_ledge(MeshBuilder& builder, const Wall& wall, float u0, float u1, float v0, float v1, float w) {
  const auto p = [&](float u, float v, float out) { return wall.at(u, v, out); };
  builder.quad(p(u0, v0, w), p(u1, v0, w), p(u1, v1, w), p(u0, v1, w));
  builder.quad(p(u0, v1, w), p(u1, v1, w), p(u1, v1, 0), p(u0, v1, 0));
  builder.quad(p(u0, v0, 0), p(u1, v0, 0), p(u1, v0, w), p(u0, v0, w));
  builder.quad(p(u0, v0, 0), p(u0, v0, w), p(u0, v1, w), p(u0, v1, 0));
  builder.quad(p(u1, v0, w), p(u1, v0, 0), p(u1, v1, 0), p(u1, v1, w));
}

void add_relief(MeshBuilder& builder, const Wall& wall, const FacadePlan& facade, float height,
                std::uint32_t seed) {
  builder.use({.material = Material::kKerb, .label = kBuildingLabel, .seed = seed, .colour = facade.trim});
  add_ledge(builder, wall, 0, wall.width, height - 0.35F, height, 0.3F);
  add_ledge(builder, wall, 0, wall.width, facade.ground - 0.12F, facade.ground + 0.06F, 0.12F);
  for (int storey = 0; storey < facade.storeys; ++storey) {
    for (int column = 0; column < facade.columns; ++column) {
      const float u = (static_cast<float>(column) + 0.5F) * facade.column;
      const float v = facade.ground + static_cast<float>(storey) * facade.storey + facade.sill;
      const float half = facade.window_width / 2 + 0.12F;
      add_ledge(builder, wall, u - half, u + half, v - 0.1F, v, 0.16F);
      add_ledge(builder, wall, u - half, u + half, v + facade.window_height, v + facade.window_height + 0.14F,
                0.07F);
    }
  }
  Dice dice(mix(seed, 77));
  if (facade.shop) {  // an awning
    builder.use({.material = Material::kCloth,
                 .label = kBuildingLabel,
                 .seed = dice.bits() | 1U,
                 .colour = facade.shop_colour});
    const float u0 = 0.6F;
    const float u1 = wall.width * dice.between(0.5F, 0.95F);
    const auto slope = [&](float u, float v, float w) { return wall.at(u, v, w); };
    builder.quad(slope(u0, 2.65F, 1.3F), slope(u1, 2.65F, 1.3F), slope(u1, 3.2F, 0.05F),
                 slope(u0, 3.2F, 0.05F));
    builder.quad(slope(u0, 2.45F, 1.3F), slope(u1, 2.45F, 1.3F), slope(u1, 2.65F, 1.3F),
                 slope(u0, 2.65F, 1.3F));
  } else {  // steps before the door
    builder.use({.material = Material::kKerb, .label = kBuildingLabel, .seed = seed});
    const float u = 0.5F * facade.column;
    add_ledge(builder, wall, u - 0.8F, u + 0.8F, 0, 0.28F, 0.5F);
  }
  builder.use(
      {.material = Material::kPlain, .label = kBuildingLabel, .seed = seed, .colour = {0.35F, 0.36F, 0.36F}});
  builder.tube(wall.at(0.18F, 0.1F, 0.12F), wall.at(0.18F, height - 0.3F, 0.12F), 0.055F, 0.055F, 6);
}

void add_balconies(MeshBuilder& builder, const Wall& wall, const FacadePlan& facade, Dice& dice) {
  for (int storey = 0; storey < facade.storeys; ++storey) {
    for (int column = 0; column < facade.columns; ++column) {
      if (!dice.chance(0.4F)) continue;
      const float u = (static_cast<float>(column) + 0.5F) * facade.column;
      const float v = facade.ground + static_cast<float>(storey) * facade.storey;
      const float half = facade.column * 0.42F;
      builder.use(
          {.material = Material::kKerb, .label = kBuildingLabel, .seed = dice.bits(), .colour = facade.trim});
      add_ledge(builder, wall, u - half, u + half, v - 0.14F, v, 0.95F);
      builder.use({.material = Material::kPlain, .label = kBuildingLabel, .colour = {0.13F, 0.14F, 0.15F}});
      for (float bar = -half; bar <= half + 0.01F; bar += half / 6) {
        builder.tube(wall.at(u + bar, v, 0.9F), wall.at(u + bar, v + 0.95F, 0.9F), 0.018F, 0.018F, 4);
      }
      builder.tube(wall.at(u - half, v + 0.95F, 0.9F), wall.at(u + half, v + 0.95F, 0.9F), 0.03F, 0.03F, 5);
      for (const float side : {-half, half}) {
        builder.tube(wall.at(u + side, v + 0.95F, 0.0F), wall.at(u + side, v + 0.95F, 0.9F), 0.03F, 0.03F, 5);
      }
      if (dice.chance(0.5F)) {  // flowers
        builder.use({.material = Material::kFoliage,
                     .label = kVegetationLabel,
                     .seed = dice.bits(),
                     .colour = {0.25F, 0.4F, 0.15F}});
        builder.ellipsoid(wall.at(u, v + 0.95F, 0.98F), {0.3F, 0.2F, 0.18F}, 6, 9, 0.25F, dice.bits());
      }
    }
  }
}

void add_roof(MeshBuilder& builder, const Vector2f& low, const Vector2f& high, float height, Dice& dice) {
  const float eaves = 0.35F;
  const float rise = dice.between(2.2F, 3.6F);
  const Vector3f colour = dice.chance(0.6F) ? Vector3f(0.48F, 0.25F, 0.18F) : Vector3f(0.3F, 0.31F, 0.34F);
  builder.use({.material = Material::kRoof, .label = kBuildingLabel, .seed = dice.bits(), .colour = colour});
  const float x0 = low.x();
  const float x1 = high.x();
  const float y0 = low.y() - eaves;
  const float y1 = high.y() + eaves;
  const float ridge = (y0 + y1) / 2;
  const float z = height - 0.1F;
  builder.quad({x0, y0, z}, {x1, y0, z}, {x1, ridge, z + rise}, {x0, ridge, z + rise});
  builder.quad({x1, y1, z}, {x0, y1, z}, {x0, ridge, z + rise}, {x1, ridge, z + rise});
  builder.use({.material = Material::kPavement, .label = kBuildingLabel, .seed = dice.bits()});
  builder.triangle({x0, y1, z}, {x0, y0, z}, {x0, ridge, z + rise}, {y1, z}, {y0, z}, {ridge, z + rise});
  builder.triangle({x1, y0, z}, {x1, y1, z}, {x1, ridge, z + rise}, {y0, z}, {y1, z}, {ridge, z + rise});
  builder.box({x0 + 1.2F, ridge - 0.4F, z}, {x0 + 2.0F, ridge + 0.4F, z + rise + 0.9F});  // chimney
}

}  // namespace

FacadePlan facade_plan(std::uint32_t seed, const Vector2f& size) {
  Dice dice(seed);
  FacadePlan plan;
  plan.brick = dice.chance(0.45F);
  plan.shop = dice.chance(0.4F);
  plan.ground = dice.between(3.5F, 4.2F);
  plan.storey = dice.between(2.9F, 3.5F);
  plan.storeys = std::max(0, static_cast<int>((size.y() - plan.ground) / plan.storey));
  const float spacing = dice.between(2.1F, 3.1F);
  plan.columns = std::max(1, static_cast<int>(size.x() / spacing));
  plan.column = size.x() / static_cast<float>(plan.columns);
  plan.window_width = plan.column * dice.between(0.42F, 0.6F);
  plan.window_height = plan.storey * dice.between(0.48F, 0.62F);
  plan.sill = plan.storey * dice.between(0.22F, 0.28F);
  const float tone = dice.between(0.75F, 1.1F);
  const float hue = dice.between(0, 1);
  if (plan.brick) {
    plan.wall = tone * Vector3f(0.58F - 0.1F * hue, 0.34F + 0.08F * hue, 0.26F + 0.12F * hue);
  } else {
    constexpr int kPlasters = 7;
    const Vector3f plasters[kPlasters] = {{0.80F, 0.72F, 0.56F}, {0.74F, 0.58F, 0.44F}, {0.66F, 0.68F, 0.66F},
                                          {0.78F, 0.76F, 0.70F}, {0.62F, 0.66F, 0.72F}, {0.72F, 0.60F, 0.56F},
                                          {0.64F, 0.66F, 0.52F}};
    plan.wall = std::min(tone, 1.05F) * plasters[dice.below(kPlasters)];
  }
  if (dice.chance(0.3F)) plan.frame = {0.28F, 0.2F, 0.15F};
  if (dice.chance(0.3F)) plan.trim = 0.8F * plan.wall;
  plan.shop_colour = {dice.between(0.1F, 0.6F), dice.between(0.12F, 0.4F), dice.between(0.1F, 0.45F)};
  return plan;
}

void add_building(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high,
                  std::uint32_t seed) {
  builder.place(Vector3f::Zero(), 0);
  Dice dice(seed);
  const FacadePlan sketch = facade_plan(seed, {10, 10});
  const float height = sketch.ground + sketch.storey * static_cast<float>(2 + dice.below(3)) + 0.6F;
  const Vector3f corners[4] = {
      {low.x(), low.y(), 0}, {high.x(), low.y(), 0}, {high.x(), high.y(), 0}, {low.x(), high.y(), 0}};
  const bool balconies = dice.chance(0.3F);
  for (int side = 0; side < 4; ++side) {
    const Vector3f& from = corners[side];
    const Vector3f& to = corners[(side + 1) % 4];
    Wall wall{from, (to - from).normalized(), {}, (to - from).norm()};
    wall.out = wall.along.cross(Vector3f::UnitZ());
    const Vector2f size(wall.width, height);
    builder.use({.material = Material::kFacade, .label = kBuildingLabel, .seed = seed, .size = size});
    builder.quad(wall.at(0, 0, 0), wall.at(wall.width, 0, 0), wall.at(wall.width, height, 0),
                 wall.at(0, height, 0));
    // Only walls along a street get details.
    const Vector3f before = wall.at(wall.width / 2, 0, 1.0F);
    const auto faces = [&](const std::vector<float>& streets, float value) {
      return std::any_of(streets.begin(), streets.end(),
                         [&](float street) { return std::abs(value - street) < plan.facade; });
    };
    const bool along_x = std::abs(wall.along.x()) > 0.5F;
    if (along_x ? !faces(plan.streets_along_x, before.y()) : !faces(plan.streets_along_y, before.x()))
      continue;
    const FacadePlan facade = facade_plan(seed, size);
    add_relief(builder, wall, facade, height, mix(seed, static_cast<std::uint32_t>(side)));
    if (balconies && wall.width > 8) add_balconies(builder, wall, facade, dice);
  }
  add_roof(builder, low, high, height, dice);
}

}  // namespace roslam::simulation
