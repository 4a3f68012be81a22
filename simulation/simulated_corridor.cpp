// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_corridor.hpp"

#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

// Brighter than surfaces can be: the renderer's light is that of the sky alone here.
const Vector3f kWhite(1.5F, 1.5F, 1.46F);
const Vector3f kDoor(1.0F, 1.1F, 1.06F);
const Vector3f kFrame(0.62F, 0.65F, 0.68F);

// A straight stretch of wall: from where, in which direction, how long; out points into the corridor.
struct Wall {
  Vector3f origin;
  Vector3f along;
  float length;

  Vector3f out() const { return Vector3f::UnitZ().cross(along); }
  Vector3f at(float u, float v, float w = 0.0F) const {
    return origin + u * along + w * out() + v * Vector3f::UnitZ();
  }
};

// A plate that stands w off the wall, from (u0, v0) to (u1, v1) on it.
void add_plate(MeshBuilder& builder, const Wall& wall, float u0, float u1, float v0, float v1, float w) {
  const auto p = [&](float u, float v, float out) { return wall.at(u, v, out); };
  builder.quad(p(u1, v0, w), p(u0, v0, w), p(u0, v1, w), p(u1, v1, w));
  builder.quad(p(u0, v1, w), p(u0, v1, 0), p(u1, v1, 0), p(u1, v1, w));
  builder.quad(p(u0, v0, w), p(u0, v0, 0), p(u0, v1, 0), p(u0, v1, w));
  builder.quad(p(u1, v0, 0), p(u1, v0, w), p(u1, v1, w), p(u1, v1, 0));
  builder.quad(p(u1, v0, w), p(u1, v0, 0), p(u0, v0, 0), p(u0, v0, w));
}

// The same door again, with its frame and handle.
void add_door(MeshBuilder& builder, const Wall& wall, float u) {
  builder.use({.material = Material::kPlain, .label = kBuildingLabel, .seed = 3, .colour = kFrame});
  add_plate(builder, wall, u - 0.55F, u + 0.55F, 0.0F, 2.1F, 0.03F);
  builder.use({.material = Material::kPlain, .label = kBuildingLabel, .seed = 4, .colour = kDoor});
  add_plate(builder, wall, u - 0.47F, u + 0.47F, 0.0F, 2.03F, 0.045F);
  builder.use({.material = Material::kPlain, .label = kBuildingLabel, .seed = 5, .colour = 0.4F * kFrame});
  add_plate(builder, wall, u + 0.32F, u + 0.43F, 1.0F, 1.04F, 0.09F);
}

void add_notices(MeshBuilder& builder, const Wall& wall, Dice& dice) {
  for (float u = dice.between(1.5F, 5.0F); u < wall.length - 1.0F; u += dice.between(4.0F, 9.0F)) {
    const float width = dice.between(0.2F, 0.45F);
    const float low = dice.between(1.3F, 1.6F);
    builder.use({.material = Material::kFacade,
                 .label = kBuildingLabel,
                 .seed = dice.bits(),
                 .size = {3.0F * width, 4.0F * width}});
    add_plate(builder, wall, u, u + width, low, low + 1.4F * width, 0.01F);
  }
}

void add_wall(MeshBuilder& builder, const CorridorPlan& plan, const Wall& wall, Dice& dice) {
  builder.use({.material = Material::kPlaster, .label = kBuildingLabel, .seed = 1, .colour = kWhite});
  builder.quad(wall.at(wall.length, 0.0F), wall.at(0.0F, 0.0F), wall.at(0.0F, plan.height),
               wall.at(wall.length, plan.height));
  builder.use({.material = Material::kPlain, .label = kBuildingLabel, .seed = 2, .colour = kFrame});
  add_plate(builder, wall, 0.0F, wall.length, 0.0F, 0.1F, 0.015F);   // skirting
  add_plate(builder, wall, 0.0F, wall.length, 0.86F, 0.92F, 0.05F);  // handrail
  constexpr float kSpacing = 3.6F;                                   // metres between doors
  for (float u = 0.5F * kSpacing; u < wall.length - 0.8F; u += kSpacing) add_door(builder, wall, u);
  add_notices(builder, wall, dice);
}

// Floor, ceiling and lamps of a rectangle.
void add_floor(MeshBuilder& builder, const CorridorPlan& plan, const Vector2f& low, const Vector2f& high,
               bool along_x) {
  builder.use({.material = Material::kTiles, .label = kRoadLabel, .seed = 1});
  builder.quad({low.x(), low.y(), 0}, {high.x(), low.y(), 0}, {high.x(), high.y(), 0}, {low.x(), high.y(), 0},
               low, high);
  const float z = plan.height;
  builder.use({.material = Material::kPlaster, .label = kBuildingLabel, .seed = 6, .colour = kWhite});
  builder.quad({low.x(), high.y(), z}, {high.x(), high.y(), z}, {high.x(), low.y(), z},
               {low.x(), low.y(), z});
  builder.use({.material = Material::kPlain,
               .label = kBuildingLabel,
               .seed = 7,
               .colour = Vector3f::Constant(2.2F)});  // they shine
  const Vector2f middle = 0.5F * (low + high);
  const float length = along_x ? high.x() - low.x() : high.y() - low.y();
  for (float s = 1.2F; s < length - 0.6F; s += 2.4F) {
    const Vector2f half = along_x ? Vector2f(0.6F, 0.15F) : Vector2f(0.15F, 0.6F);
    const Vector2f at = along_x ? Vector2f(low.x() + s, middle.y()) : Vector2f(middle.x(), low.y() + s);
    builder.box({at.x() - half.x(), at.y() - half.y(), z - 0.06F}, {at.x() + half.x(), at.y() + half.y(), z});
  }
}

}  // namespace

Mesh build_corridor(const CorridorPlan& plan, std::uint32_t seed) {
  Mesh mesh;
  MeshBuilder builder(mesh);
  builder.place(Vector3f::Zero(), 0);
  Dice dice(mix(seed, 0xc0221d02U));
  const float w = plan.half_width;
  const float outer = plan.corner + w;
  const float inner = plan.corner - w;
  const Vector3f x = Vector3f::UnitX();
  const Vector3f y = Vector3f::UnitY();
  add_wall(builder, plan, {{plan.start, -w, 0}, x, outer - plan.start}, dice);  // to the right
  add_wall(builder, plan, {{outer, -w, 0}, y, plan.end + w}, dice);
  add_wall(builder, plan, {{outer, plan.end, 0}, -x, 2 * w}, dice);  // the end
  add_wall(builder, plan, {{inner, plan.end, 0}, -y, plan.end - w}, dice);
  add_wall(builder, plan, {{inner, w, 0}, -x, inner - plan.start}, dice);  // to the left
  add_wall(builder, plan, {{plan.start, w, 0}, -y, 2 * w}, dice);          // behind the start
  add_floor(builder, plan, {plan.start, -w}, {outer, w}, true);
  add_floor(builder, plan, {inner, w}, {outer, plan.end}, false);
  return mesh;
}

}  // namespace roslam::simulation
