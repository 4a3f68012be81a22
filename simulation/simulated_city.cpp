// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_city.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kDepthOfHouse = 10.0F;

// The gaps between neighbouring streets, as intervals from wall to wall.
std::vector<Vector2f> gaps(const std::vector<float>& streets, float low, float high, float half) {
  std::vector<Vector2f> result;
  float from = low;
  for (const float street : streets) {
    result.emplace_back(from, street - half);
    from = street + half;
  }
  result.emplace_back(from, high);
  return result;
}

void add_ground(MeshBuilder& builder, const CityPlan& plan) {
  builder.use({.material = Material::kRoad, .label = kRoadLabel});
  const Vector2f low = plan.low - Vector2f(60, 60);
  const Vector2f high = plan.high + Vector2f(60, 60);
  builder.quad({low.x(), low.y(), 0}, {high.x(), low.y(), 0}, {high.x(), high.y(), 0}, {low.x(), high.y(), 0},
               low, high);
}

void add_pavement(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high) {
  builder.place(Vector3f::Zero(), 0);
  const float z = plan.kerb_height;
  const float rim = 0.18F;  // kerb stones
  builder.use({.material = Material::kPavement, .label = kSidewalkLabel});
  builder.quad({low.x() + rim, low.y() + rim, z}, {high.x() - rim, low.y() + rim, z},
               {high.x() - rim, high.y() - rim, z}, {low.x() + rim, high.y() - rim, z},
               low + Vector2f(rim, rim), high - Vector2f(rim, rim));
  builder.use({.material = Material::kKerb, .label = kSidewalkLabel, .seed = 7});
  builder.box({low.x(), low.y(), -0.1F}, {high.x(), low.y() + rim, z});
  builder.box({low.x(), high.y() - rim, -0.1F}, {high.x(), high.y(), z});
  builder.box({low.x(), low.y() + rim, -0.1F}, {low.x() + rim, high.y() - rim, z});
  builder.box({high.x() - rim, low.y() + rim, -0.1F}, {high.x(), high.y() - rim, z});
}

// A small park with a low wall, in place of a house.
void add_garden(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high,
                Dice& dice) {
  builder.place(Vector3f::Zero(), 0);
  const float z = plan.kerb_height + 0.05F;
  builder.use({.material = Material::kGrass, .label = kTerrainLabel, .seed = dice.bits()});
  builder.quad({low.x(), low.y(), z}, {high.x(), low.y(), z}, {high.x(), high.y(), z}, {low.x(), high.y(), z},
               low, high);
  builder.use(
      {.material = Material::kFacade, .label = kBuildingLabel, .seed = dice.bits(), .size = {1, 0.9F}});
  const float wall = 0.25F;
  builder.box({low.x(), low.y(), 0}, {high.x(), low.y() + wall, 0.9F});
  builder.box({low.x(), high.y() - wall, 0}, {high.x(), high.y(), 0.9F});
  for (int i = 0; i < 3; ++i) {
    const Vector3f foot(dice.between(low.x() + 2, high.x() - 2), dice.between(low.y() + 2, high.y() - 2),
                        0.1F);
    add_tree(builder, foot, dice.bits());
  }
}

// Houses wall to wall along x between two values of x.
void add_row(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high,
             Dice& dice) {
  float x = low.x();
  while (x < high.x() - 1.0F) {
    float width = dice.between(9.0F, 15.0F);
    if (high.x() - x - width < 8.0F) width = high.x() - x;  // no sliver at the end of the row
    const bool corner = x == low.x() || x + width >= high.x();
    if (!corner && dice.chance(0.1F)) {
      add_garden(builder, plan, {x, low.y()}, {x + width, high.y()}, dice);
    } else {
      add_building(builder, plan, {x, low.y()}, {x + width, high.y()}, dice.bits());
    }
    x += width;
  }
}

void add_block(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high,
               Dice& dice) {
  const float edge = plan.facade - plan.kerb;
  add_pavement(builder, plan, low - Vector2f(edge, edge), high + Vector2f(edge, edge));
  const float south = low.y() + kDepthOfHouse;
  const float north = high.y() - kDepthOfHouse;
  add_row(builder, plan, low, {high.x(), south}, dice);
  add_row(builder, plan, {low.x(), north}, high, dice);
  if (north - south > 4.0F) {
    add_building(builder, plan, {low.x(), south}, {low.x() + kDepthOfHouse, north}, dice.bits());
    add_building(builder, plan, {high.x() - kDepthOfHouse, south}, {high.x(), north}, dice.bits());
  }
}

// Trees, lamps, signs and the like along one edge of a pavement, from one end to the other.
void add_kerbside(MeshBuilder& builder, const CityPlan& plan, const Vector2f& from, const Vector2f& to,
                  const Vector2f& inwards, Dice& dice) {
  const Vector2f along = (to - from).normalized();
  const float length = (to - from).norm();
  const float facing = std::atan2(-inwards.y(), -inwards.x());
  int turn = 0;
  for (float s = 4.0F + dice.between(0, 3); s < length - 3.0F; s += dice.between(3.6F, 5.6F), ++turn) {
    const Vector2f kerbside = from + s * along + (0.55F + dice.between(0, 0.15F)) * inwards;
    const Vector3f foot(kerbside.x(), kerbside.y(), plan.kerb_height);
    switch (turn % 5) {
      case 0:
      case 3:
        add_tree(builder, foot, dice.bits());
        break;
      case 2:
        add_lamp(builder, foot, facing);
        break;
      case 1:
        if (dice.chance(0.5F)) {
          const float heading = std::atan2(along.y(), along.x());
          add_sign(builder, foot, heading + (dice.chance(0.5F) ? 0.0F : kPi), dice.bits());
          break;
        }
        [[fallthrough]];
      default:
        add_street_furniture(builder, foot, facing, dice.bits());
        break;
    }
  }
}

}  // namespace

bool CityPlan::in_crossing(const Vector2f& point, float margin) const {
  const auto near = [&](const std::vector<float>& streets, float value) {
    return std::any_of(streets.begin(), streets.end(),
                       [&](float street) { return std::abs(value - street) < kerb + margin; });
  };
  return near(streets_along_y, point.x()) && near(streets_along_x, point.y());
}

Sightlines::Sightlines(const CityPlan& plan) {
  const Vector2f rim(0.5F, 0.5F);
  for (const Vector2f& column : gaps(plan.streets_along_y, plan.low.x(), plan.high.x(), plan.facade)) {
    for (const Vector2f& row : gaps(plan.streets_along_x, plan.low.y(), plan.high.y(), plan.facade)) {
      blocks_.emplace_back(Vector2f(column.x(), row.x()) + rim, Vector2f(column.y(), row.y()) - rim);
    }
  }
}

bool Sightlines::blocked(const Vector2f& from, const Vector2f& to) const {
  const Vector2f step = to - from;
  return std::any_of(blocks_.begin(), blocks_.end(), [&](const Eigen::AlignedBox2f& block) {
    float enter = 0.0F;
    float leave = 1.0F;
    for (int axis = 0; axis < 2; ++axis) {
      const float slope = std::abs(step[axis]) > 1e-6F ? step[axis] : 1e-6F;
      const float a = (block.min()[axis] - from[axis]) / slope;
      const float b = (block.max()[axis] - from[axis]) / slope;
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave;
  });
}

bool Sightlines::hidden(const Vector2f& from, const Vector2f& to, float radius) const {
  const Vector2f along = (to - from).normalized();
  const Vector2f aside = radius * Vector2f(-along.y(), along.x());
  return blocked(from, to) && blocked(from, to + aside) && blocked(from, to - aside);
}

Mesh build_city(const CityPlan& plan, std::uint32_t seed) {
  Mesh mesh;
  MeshBuilder builder(mesh);
  Dice dice(mix(seed, 0xc17U));
  add_ground(builder, plan);
  const auto columns = gaps(plan.streets_along_y, plan.low.x(), plan.high.x(), plan.facade);
  const auto rows = gaps(plan.streets_along_x, plan.low.y(), plan.high.y(), plan.facade);
  const float edge = plan.facade - plan.kerb;
  for (const Vector2f& column : columns) {
    for (const Vector2f& row : rows) {
      add_block(builder, plan, {column.x(), row.x()}, {column.y(), row.y()}, dice);
      const Vector2f low(column.x() - edge, row.x() - edge);
      const Vector2f high(column.y() + edge, row.y() + edge);
      add_kerbside(builder, plan, low, {high.x(), low.y()}, {0, 1}, dice);
      add_kerbside(builder, plan, {low.x(), high.y()}, high, {0, -1}, dice);
      add_kerbside(builder, plan, low, {low.x(), high.y()}, {1, 0}, dice);
      add_kerbside(builder, plan, {high.x(), low.y()}, high, {-1, 0}, dice);
    }
  }
  // Houses close the ends of the streets, so that the camera never sees beyond the city.
  const Vector2f out(12, 12);
  const Vector2f low = plan.low - out;
  const Vector2f high = plan.high + out;
  add_row(builder, plan, low, {high.x(), plan.low.y()}, dice);
  add_row(builder, plan, {low.x(), plan.high.y()}, high, dice);
  for (const float y : plan.streets_along_x) {
    add_building(builder, plan, {low.x(), y - 9}, {plan.low.x(), y + 9}, dice.bits());
    add_building(builder, plan, {plan.high.x(), y - 9}, {high.x(), y + 9}, dice.bits());
  }
  return mesh;
}

}  // namespace roslam::simulation
