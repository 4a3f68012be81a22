// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "simulation/simulated_actors.hpp"
#include "simulation/simulated_city.hpp"
#include "simulation/simulated_corridor.hpp"
#include "simulation/simulated_noise.hpp"
#include "simulation/simulated_options.hpp"

namespace roslam::simulation {

/// All movable objects, parked cars included, and their motion over time.
class Traffic {
 public:
  Traffic(const CityPlan& plan, TrafficLevel level, std::uint32_t seed);
  Traffic(const CorridorPlan& plan, TrafficLevel level, std::uint32_t seed);

  /// Adds the actors near the camera at that time (seconds).
  void add_to(Mesh& mesh, double time, const SE3& T_world_camera) const;

 private:
  enum class Kind { kCar, kPedestrian, kCyclist };

  /// Moves straight from `from` to `to`, then starts over, or goes to and fro.
  struct Actor {
    Kind kind = Kind::kCar;
    std::uint16_t instance = 0;
    std::uint32_t seed = 0;
    Vector2f from, to;
    float speed = 0.0F;  ///< metres a second; 0 is parked
    float start = 0.0F;  ///< metres from `from` at time 0
    bool to_and_fro = false;
    float height = 0.0F;  ///< of the ground
  };

  void park_cars(const CityPlan& plan, Dice& dice);
  void fill_lane(Kind kind, const Vector2f& from, const Vector2f& to, float speed, float gap, float height,
                 Dice& dice);
  void fill_pavement(const Vector2f& from, const Vector2f& to, const Vector2f& inwards, float gap,
                     bool to_and_fro, Dice& dice);
  void fill_street_along_x(const CityPlan& plan, float y, TrafficLevel level, Dice& dice);
  void fill_street_along_y(const CityPlan& plan, float x, TrafficLevel level, Dice& dice);
  static Stance stance_of(const Actor& actor, double time);

  std::vector<Actor> actors_;
  std::uint16_t last_instance_ = 0;
  float kerb_height_ = 0.12F;
  Sightlines sightlines_;
};

}  // namespace roslam::simulation
