// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "simulation/simulated_mesh.hpp"

namespace roslam::simulation {

/// The plan of the city: streets along x and along y that cross at right angles; world frame with z up,
/// metres. The drone flies along the street at y = 0; its two crossings and the street at y = 44 bound the
/// block that the path `loop` flies around.
struct CityPlan {
  std::vector<float> streets_along_y{-70, -6, 58, 122, 186};  ///< x of each centre line
  std::vector<float> streets_along_x{-44, 0, 44, 88};         ///< y of each centre line
  Vector2f low{-112, -82};                                    ///< corners of the city's outline
  Vector2f high{226, 126};
  float lane = 1.55F;    ///< centre line of the street to centre line of a lane
  float parking = 4.1F;  ///< to the middle of a parked car
  float kerb = 5.2F;     ///< to the edge of the pavement
  float facade = 8.3F;   ///< to the walls of the houses
  float kerb_height = 0.12F;

  /// Whether the point lies where two streets cross, or within `margin` of it.
  bool in_crossing(const Vector2f& point, float margin) const;
};

/// Line-of-sight test: which objects the houses occlude.
class Sightlines {
 public:
  Sightlines() = default;  ///< where nothing occludes
  explicit Sightlines(const CityPlan& plan);

  /// Whether houses occlude an object of that radius (metres) at `to` from a viewpoint at `from`.
  bool hidden(const Vector2f& from, const Vector2f& to, float radius) const;

 private:
  bool blocked(const Vector2f& from, const Vector2f& to) const;
  std::vector<Eigen::AlignedBox2f> blocks_;
};

/// The static scene, without movable objects: parked cars belong to Traffic.
Mesh build_city(const CityPlan& plan, std::uint32_t seed);

/// Layout and colours of a facade; a function of its seed and its size (metres).
struct FacadePlan {
  bool brick = false;
  bool shop = false;    ///< the ground floor is a shop front
  float ground = 3.9F;  ///< height of the ground floor, metres
  float storey = 3.2F;  ///< height of the others
  int storeys = 3;      ///< above the ground floor
  int columns = 4;      ///< of windows
  float column = 2.6F;  ///< width of each
  float window_width = 1.2F;
  float window_height = 1.7F;
  float sill = 0.85F;  ///< height of the window above the floor
  Vector3f wall{0.7F, 0.65F, 0.55F};
  Vector3f trim{0.85F, 0.83F, 0.8F};
  Vector3f frame{0.9F, 0.9F, 0.88F};
  Vector3f shop_colour{0.2F, 0.35F, 0.3F};
};
FacadePlan facade_plan(std::uint32_t seed, const Vector2f& size);

// The parts of the city. foot: on the ground, world frame, metres; yaw: radians about z.
void add_building(MeshBuilder& builder, const CityPlan& plan, const Vector2f& low, const Vector2f& high,
                  std::uint32_t seed);
void add_tree(MeshBuilder& builder, const Vector3f& foot, std::uint32_t seed);
void add_lamp(MeshBuilder& builder, const Vector3f& foot, float yaw);
void add_sign(MeshBuilder& builder, const Vector3f& foot, float yaw, std::uint32_t seed);
void add_street_furniture(MeshBuilder& builder, const Vector3f& foot, float yaw, std::uint32_t seed);

}  // namespace roslam::simulation
