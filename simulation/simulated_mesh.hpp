// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace roslam::simulation {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Cityscapes train ids.
enum Label : std::uint8_t {
  kRoadLabel = 0,
  kSidewalkLabel = 1,
  kBuildingLabel = 2,
  kPoleLabel = 5,
  kSignLabel = 7,
  kVegetationLabel = 8,
  kTerrainLabel = 9,
  kSkyLabel = 10,
  kPersonLabel = 11,
  kRiderLabel = 12,
  kCarLabel = 13,
  kBicycleLabel = 18,
  kVoidLabel = 255,
};

/// Texture of a surface; texture coordinates are metres on the surface.
enum class Material : std::uint8_t {
  kPlain,
  kRoad,
  kPavement,
  kKerb,
  kFacade,
  kRoof,
  kBark,
  kFoliage,
  kGrass,
  kSign,
  kPaint,  ///< of a car body; texture coordinates are along and up the car
  kGlass,
  kCloth,
  kTiles,    ///< all the same
  kPlaster,  ///< smooth and nearly without texture
};

/// Appearance and ground truth shared by the triangles of one part of an object.
struct Surface {
  Material material = Material::kPlain;
  std::uint8_t label = kVoidLabel;
  std::uint16_t instance = 0;                  ///< of a moving object, from 1; else 0
  std::uint32_t seed = 0;                      ///< selects colours and patterns
  Vector3f colour = Vector3f::Constant(0.5F);  ///< red, green, blue in [0, 1]
  Vector2f size = Vector2f::Ones();            ///< metres; of a facade or a sign
};

/// Triangles in the world frame, metres; positions, normals and uvs are one a vertex.
struct Mesh {
  std::vector<Vector3f> positions;
  std::vector<Vector3f> normals;
  std::vector<Vector2f> uvs;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> surface_of;  ///< of each triangle
  std::vector<Surface> surfaces;

  void clear();
};

/// Adds simple solids to a mesh, in a local frame that is placed in the world.
class MeshBuilder {
 public:
  explicit MeshBuilder(Mesh& mesh) : mesh_(mesh) {}

  void place(const Eigen::Isometry3f& T_world_local) { T_world_local_ = T_world_local; }
  /// Places the origin of the local frame at a point of the world, turned about the vertical (yaw, radians).
  void place(const Vector3f& origin, float yaw);
  /// The surface of all that is added from now on.
  void use(const Surface& surface);

  /// Tessellation of round solids from now on: 1 is full detail, for near objects.
  void set_detail(float detail) { detail_ = detail; }
  float detail() const { return detail_; }
  bool coarse() const { return detail_ < 0.45F; }  ///< too far away for small parts to be seen

  /// Corners anticlockwise as seen from outside.
  void quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d, const Vector2f& uv_a,
            const Vector2f& uv_c);
  /// As quad, with the width and height of the quad as its texture coordinates.
  void quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d);
  void triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector2f& uv_a,
                const Vector2f& uv_b, const Vector2f& uv_c);
  void box(const Vector3f& low, const Vector3f& high);
  /// A closed tube that tapers from one radius to the other.
  void tube(const Vector3f& from, const Vector3f& to, float radius_from, float radius_to, int sides_in_full,
            float flatness = 1.0F);
  void ellipsoid(const Vector3f& centre, const Vector3f& radii, int rings_in_full, int sides_in_full,
                 float roughness = 0.0F, std::uint32_t seed = 0);
  /// A closed surface through rings of the same number of points; smooth across, texture coordinates (x, z).
  void loft(const std::vector<std::vector<Vector3f>>& rings);

 private:
  std::uint32_t vertex(const Vector3f& position, const Vector3f& normal, const Vector2f& uv);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  int divisions(int in_full) const;

  Mesh& mesh_;
  Eigen::Isometry3f T_world_local_ = Eigen::Isometry3f::Identity();
  float detail_ = 1.0F;
};

}  // namespace roslam::simulation
