// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_traffic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace roslam::simulation {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSight = 85.0F;  // metres; farther actors are smaller than a few pixels
constexpr float kBehind = 7.0F;  // metres behind the camera: a shadow from there may still be visible
constexpr float kReach = 60.0F;  // metres that lanes extend beyond the crossings of the flown block

}  // namespace

Traffic::Traffic(const CityPlan& plan, TrafficLevel level, std::uint32_t seed)
    : kerb_height_(plan.kerb_height), sightlines_(plan) {
  Dice dice(mix(seed, 0x7aff1cU));
  park_cars(plan, dice);
  if (level == TrafficLevel::kNone) return;
  for (const float y : {0.0F, 44.0F}) fill_street_along_x(plan, y, level, dice);
  for (const float x : {-6.0F, 58.0F}) fill_street_along_y(plan, x, level, dice);
}

// People who walk to and fro along the first part of the corridor, on either side of its centre line.
Traffic::Traffic(const CorridorPlan& plan, TrafficLevel level, std::uint32_t seed) : kerb_height_(0.0F) {
  if (level == TrafficLevel::kNone) return;
  Dice dice(mix(seed, 0x7aff1cU));
  const float gap = level == TrafficLevel::kHeavy ? 7.0F : 18.0F;
  for (const float side : {-0.65F, 0.65F}) {
    fill_lane(Kind::kPedestrian, {plan.start + 1.0F, side}, {plan.corner - 0.5F, side},
              dice.between(0.6F, 1.3F), gap, 0.0F, dice);
  }
  for (Actor& actor : actors_) actor.to_and_fro = true;
}

void Traffic::park_cars(const CityPlan& plan, Dice& dice) {
  const auto row = [&](const Vector2f& from, const Vector2f& to) {
    const Vector2f along = (to - from).normalized();
    const float length = (to - from).norm();
    for (float s = 3.0F; s < length; s += dice.between(5.6F, 7.4F)) {
      const std::uint32_t looks = dice.bits();
      const Vector2f point = from + s * along + 0.08F * dice.between(-1, 1) * Vector2f(-along.y(), along.x());
      if (!dice.chance(0.6F) || plan.in_crossing(point, 6.5F)) continue;
      actors_.push_back({.kind = Kind::kCar, .seed = looks, .from = point, .to = point + along});
    }
  };
  for (const float y : plan.streets_along_x) {
    row({plan.low.x(), y - plan.parking}, {plan.high.x(), y - plan.parking});
    row({plan.high.x(), y + plan.parking}, {plan.low.x(), y + plan.parking});
  }
  for (const float x : plan.streets_along_y) {
    row({x + plan.parking, plan.low.y()}, {x + plan.parking, plan.high.y()});
    row({x - plan.parking, plan.high.y()}, {x - plan.parking, plan.low.y()});
  }
}

// Actors one after the other at the same speed, so that none catches up with the next.
void Traffic::fill_lane(Kind kind, const Vector2f& from, const Vector2f& to, float speed, float gap,
                        float height, Dice& dice) {
  const float length = (to - from).norm();
  const auto count = std::max(1, static_cast<int>(length / gap));
  const float spacing = length / static_cast<float>(count);
  const float first = dice.between(0, spacing);
  for (int i = 0; i < count; ++i) {
    const float start = first + spacing * (static_cast<float>(i) + dice.between(0, 0.25F));
    actors_.push_back({.kind = kind,
                       .instance = ++last_instance_,
                       .seed = dice.bits(),
                       .from = from,
                       .to = to,
                       .speed = speed,
                       .start = start,
                       .height = height});
  }
}

// Pedestrians in three lanes, which differ in direction and speed.
void Traffic::fill_pavement(const Vector2f& from, const Vector2f& to, const Vector2f& inwards, float gap,
                            bool to_and_fro, Dice& dice) {
  for (int file = 0; file < 3; ++file) {
    const Vector2f side = (1.2F + 0.55F * static_cast<float>(file)) * inwards;
    const bool back = dice.chance(0.5F);
    const auto first = actors_.size();
    fill_lane(Kind::kPedestrian, (back ? to : from) + side, (back ? from : to) + side,
              dice.between(0.9F, 1.6F), 3 * gap, kerb_height_, dice);
    for (auto i = first; i < actors_.size(); ++i) actors_[i].to_and_fro = to_and_fro;
  }
}

void Traffic::fill_street_along_x(const CityPlan& plan, float y, TrafficLevel level, Dice& dice) {
  const bool heavy = level == TrafficLevel::kHeavy;
  const float x0 = -6.0F - kReach;
  const float x1 = 58.0F + kReach + 20.0F;
  const float bicycle = plan.lane + 1.25F;
  // Cars to the right of the drone: in heavy traffic a slow queue, else a single one now and then.
  fill_lane(Kind::kCar, {x0, y - plan.lane}, {x1, y - plan.lane}, heavy ? 1.45F : 3.6F, heavy ? 9.0F : 95.0F,
            0, dice);
  fill_lane(Kind::kCyclist, {x0, y - bicycle}, {x1, y - bicycle}, heavy ? 2.2F : 2.6F, heavy ? 14.0F : 65.0F,
            0, dice);
  if (heavy) {  // to the left a crowd on foot and on bicycles
    for (int file = 0; file < 5; ++file) {
      const float side = y + 0.45F + 0.62F * static_cast<float>(file);
      const bool back = file >= 2;
      const Kind kind = file == 2 ? Kind::kCyclist : Kind::kPedestrian;
      fill_lane(kind, {back ? x1 : x0, side}, {back ? x0 : x1, side}, dice.between(1.0F, 1.5F), 4.2F, 0,
                dice);
    }
  } else {
    fill_lane(Kind::kCar, {x1, y + plan.lane}, {x0, y + plan.lane}, 4.4F, 80.0F, 0, dice);
    fill_lane(Kind::kCyclist, {x1, y + bicycle}, {x0, y + bicycle}, 3.2F, 90.0F, 0, dice);
  }
  const float gap = heavy ? 2.6F : 11.0F;
  fill_pavement({x0, y - plan.kerb}, {x1, y - plan.kerb}, {0, -1}, gap, false, dice);
  fill_pavement({x0, y + plan.kerb}, {x1, y + plan.kerb}, {0, 1}, gap, false, dice);
}

// Streets along y have pedestrians and cyclists only: cars would need traffic lights at the crossings.
void Traffic::fill_street_along_y(const CityPlan& plan, float x, TrafficLevel level, Dice& dice) {
  const bool heavy = level == TrafficLevel::kHeavy;
  const float gap = heavy ? 2.6F : 10.0F;
  for (const float y : {0.0F, 44.0F, -44.0F}) {
    const float y0 = y + plan.facade + 0.5F;
    const float y1 = y + 44.0F - plan.facade - 0.5F;
    fill_pavement({x - plan.kerb, y0}, {x - plan.kerb, y1}, {-1, 0}, gap, true, dice);
    fill_pavement({x + plan.kerb, y0}, {x + plan.kerb, y1}, {1, 0}, gap, true, dice);
    const auto first = actors_.size();
    for (const float side : {-2.4F, 2.5F}) {
      fill_lane(Kind::kCyclist, {x + side, y0}, {x + side, y1}, 2.4F, heavy ? 7.0F : 25.0F, 0, dice);
    }
    if (heavy) {
      for (const float side : {-1.2F, 0.3F, 1.4F}) {
        fill_lane(Kind::kPedestrian, {x + side, y0}, {x + side, y1}, dice.between(0.9F, 1.4F), 4.0F, 0, dice);
      }
    }
    for (auto i = first; i < actors_.size(); ++i) actors_[i].to_and_fro = true;
  }
}

Stance Traffic::stance_of(const Actor& actor, double time) {
  const Vector2f along = (actor.to - actor.from).normalized();
  const float length = (actor.to - actor.from).norm();
  const double way = static_cast<double>(actor.start) + static_cast<double>(actor.speed) * time;
  const double lap = static_cast<double>(actor.to_and_fro ? 2 * length : length);
  const auto s = static_cast<float>(way - lap * std::floor(way / lap));
  Stance stance;
  stance.way = static_cast<float>(way);
  stance.yaw = std::atan2(along.y(), along.x());
  float reached = s;
  if (actor.to_and_fro) {
    // At each end they turn round in the time that about a metre takes.
    reached = s < length ? s : 2 * length - s;
    const auto rise = [](float t) { return std::clamp(t + 0.5F, 0.0F, 1.0F); };
    stance.yaw += kPi * (rise(s - length) - rise(s - 2 * length) - rise(s));
  }
  const Vector2f point = actor.from + reached * along;
  stance.foot = {point.x(), point.y(), actor.height};
  return stance;
}

void Traffic::add_to(Mesh& mesh, double time, const SE3& T_world_camera) const {
  MeshBuilder builder(mesh);
  const Vector3f eye = T_world_camera.translation().cast<float>();
  const Vector3f forward = (T_world_camera.rotation() * Eigen::Vector3d::UnitZ()).cast<float>();
  const Vector2f ahead = forward.head<2>().normalized();
  for (const Actor& actor : actors_) {
    const Stance stance =
        actor.speed > 0 ? stance_of(actor, time)
                        : Stance{{actor.from.x(), actor.from.y(), actor.height},
                                 std::atan2(actor.to.y() - actor.from.y(), actor.to.x() - actor.from.x()),
                                 0};
    const Vector2f offset = (stance.foot - eye).head<2>();
    const float depth = offset.dot(ahead);
    const float aside = std::abs(offset.x() * ahead.y() - offset.y() * ahead.x());
    if (depth < -kBehind || depth > kSight || aside > 1.1F * std::max(depth, 0.0F) + 9.0F) continue;
    if (depth > 20.0F && sightlines_.hidden(eye.head<2>(), stance.foot.head<2>(), 4.0F)) continue;
    builder.set_detail(std::clamp(8.0F / std::max(depth, 1.0F), 0.3F, 1.0F));
    switch (actor.kind) {
      case Kind::kCar:
        add_car(builder, stance, actor.instance, actor.seed);
        break;
      case Kind::kPedestrian:
        add_pedestrian(builder, stance, actor.instance, actor.seed);
        break;
      case Kind::kCyclist:
        add_cyclist(builder, stance, actor.instance, actor.seed);
        break;
    }
  }
}

}  // namespace roslam::simulation
