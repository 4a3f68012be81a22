// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {
namespace {
constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
}  // namespace

void Mesh::clear() {
  positions.clear();
  normals.clear();
  uvs.clear();
  triangles.clear();
  surface_of.clear();
  surfaces.clear();
}

void MeshBuilder::place(const Vector3f& origin, float yaw) {
  T_world_local_ = Eigen::Translation3f(origin) * Eigen::AngleAxisf(yaw, Vector3f::UnitZ());
}

void MeshBuilder::use(const Surface& surface) { mesh_.surfaces.push_back(surface); }

std::uint32_t MeshBuilder::vertex(const Vector3f& position, const Vector3f& normal, const Vector2f& uv) {
  mesh_.positions.push_back(T_world_local_ * position);
  mesh_.normals.push_back(T_world_local_.linear() * normal);
  mesh_.uvs.push_back(uv);
  return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
}

void MeshBuilder::face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.surface_of.push_back(static_cast<std::uint32_t>(mesh_.surfaces.size() - 1));
}

int MeshBuilder::divisions(int in_full) const {
  return std::max(std::min(in_full, 4), static_cast<int>(std::lround(static_cast<float>(in_full) * detail_)));
}

void MeshBuilder::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
                       const Vector2f& uv_a, const Vector2f& uv_c) {
  const Vector3f normal = (b - a).cross(d - a).normalized();
  const auto i = vertex(a, normal, uv_a);
  vertex(b, normal, {uv_c.x(), uv_a.y()});
  vertex(c, normal, uv_c);
  vertex(d, normal, {uv_a.x(), uv_c.y()});
  face(i, i + 1, i + 2);
  face(i, i + 2, i + 3);
}

void MeshBuilder::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  quad(a, b, c, d, {0, 0}, {(b - a).norm(), (d - a).norm()});
}

void MeshBuilder::triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector2f& uv_a,
                           const Vector2f& uv_b, const Vector2f& uv_c) {
  const Vector3f normal = (b - a).cross(c - a).normalized();
  const auto i = vertex(a, normal, uv_a);
  vertex(b, normal, uv_b);
  vertex(c, normal, uv_c);
  face(i, i + 1, i + 2);
}

void MeshBuilder::box(const Vector3f& low, const Vector3f& high) {
  const auto corner = [&](int i) {
    return Vector3f((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                    (i & 4) != 0 ? high.z() : low.z());
  };
  quad(corner(0), corner(1), corner(5), corner(4));  // -y
  quad(corner(3), corner(2), corner(6), corner(7));  // +y
  quad(corner(2), corner(0), corner(4), corner(6));  // -x
  quad(corner(1), corner(3), corner(7), corner(5));  // +x
  quad(corner(4), corner(5), corner(7), corner(6));  // top
  quad(corner(2), corner(3), corner(1), corner(0));  // bottom
}

void MeshBuilder::tube(const Vector3f& from, const Vector3f& to, float radius_from, float radius_to,
                       int sides_in_full, float flatness) {
  const int sides = divisions(sides_in_full);
  const Vector3f axis = to - from;
  const float length = axis.norm();
  const Vector3f w = axis / std::max(length, 1e-6F);
  // The side axis is kept level where possible, so that "flat" tubes such as a torso are flat front to back.
  Vector3f v = w.cross(std::abs(w.x()) < 0.8F ? Vector3f::UnitX() : Vector3f::UnitZ()).normalized();
  const Vector3f u = v.cross(w);
  const auto sides_f = static_cast<float>(sides);
  const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (int i = 0; i <= sides; ++i) {
    const float angle = kTurn * static_cast<float>(i) / sides_f;
    const Vector3f out = flatness * std::cos(angle) * u + std::sin(angle) * v;
    const Vector3f normal = (std::cos(angle) / flatness * u + std::sin(angle) * v).normalized();
    const float around = angle * radius_from;
    vertex(from + radius_from * out, normal, {around, 0});
    vertex(to + radius_to * out, normal, {around, length});
  }
  const auto centre_from = vertex(from - 0.3F * radius_from * w, -w, {0, 0});
  const auto centre_to = vertex(to + 0.3F * radius_to * w, w, {0, length});
  for (int i = 0; i < sides; ++i) {
    const auto at = first + 2U * static_cast<std::uint32_t>(i);
    face(at, at + 2, at + 3);
    face(at, at + 3, at + 1);
    if (coarse()) continue;  // open ends are not visible from afar
    face(centre_from, at + 2, at);
    face(centre_to, at + 1, at + 3);
  }
}

void MeshBuilder::ellipsoid(const Vector3f& centre, const Vector3f& radii, int rings_in_full,
                            int sides_in_full, float roughness, std::uint32_t seed) {
  const int rings = divisions(rings_in_full);
  const int sides = divisions(sides_in_full);
  const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
  const float girth = kTurn * 0.5F * (radii.x() + radii.y());
  for (int j = 0; j <= rings; ++j) {
    const float polar = kTurn / 2 * static_cast<float>(j) / static_cast<float>(rings);
    for (int i = 0; i <= sides; ++i) {
      const float turn = static_cast<float>(i % sides) / static_cast<float>(sides);
      const Vector3f out(std::sin(polar) * std::cos(kTurn * turn), std::sin(polar) * std::sin(kTurn * turn),
                         std::cos(polar));
      const bool pole = j == 0 || j == rings;
      const auto bits =
          mix(seed, static_cast<std::uint32_t>(j), pole ? 0U : static_cast<std::uint32_t>(i % sides));
      const float swell = 1.0F + roughness * (2.0F * unit(bits) - 1.0F);
      const Vector3f normal = (out.cwiseQuotient(radii) * radii.x() +
                               roughness * Vector3f(simulation::normal(bits), simulation::normal(mix(bits)),
                                                    simulation::normal(mix(bits, 3))))
                                  .normalized();
      vertex(centre + swell * out.cwiseProduct(radii), normal,
             {girth * static_cast<float>(i) / static_cast<float>(sides), polar * radii.z()});
    }
  }
  const auto row = static_cast<std::uint32_t>(sides) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rings); ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const auto at = first + j * row + i;
      face(at, at + row, at + row + 1);
      face(at, at + row + 1, at + 1);
    }
  }
}

void MeshBuilder::loft(const std::vector<std::vector<Vector3f>>& rings) {
  const auto points = rings.front().size();
  for (std::size_t j = 0; j + 1 < rings.size(); ++j) {
    for (std::size_t i = 0; i + 1 < points; ++i) {
      const Vector3f& a = rings[j][i];
      const Vector3f& b = rings[j + 1][i];
      const Vector3f& c = rings[j + 1][i + 1];
      const Vector3f& d = rings[j][i + 1];
      const auto uv = [](const Vector3f& p) { return Vector2f(p.x(), p.z()); };
      triangle(a, b, c, uv(a), uv(b), uv(c));
      triangle(a, c, d, uv(a), uv(c), uv(d));
    }
  }
}

}  // namespace roslam::simulation
