// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_paint.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/simulated_city.hpp"
#include "simulation/simulated_paint_tools.hpp"

namespace roslam::simulation {

Painter::Painter(const CityPlan& plan, std::uint32_t seed)
    : plan_(plan),
      seed_(mix(seed, 0xc0104U)),
      grain_(Detail::kGrain, mix(seed, 1)),
      cracks_(Detail::kCracks, mix(seed, 2)),
      leaves_(Detail::kLeaves, mix(seed, 3)) {}

float Painter::grain(const Vector2f& uv, float tile, float footprint) const {
  return grain_.sample(uv.x() / tile, uv.y() / tile, footprint / tile);
}

// Noise at three scales with incommensurable periods, so that no repetition is visible.
float Painter::mottle(const Vector2f& uv, float footprint, std::uint32_t seed) const {
  const Vector2f shift(between(seed, 0, 50), between(mix(seed), 0, 50));
  return 0.4F * grain(uv + shift, 0.83F, footprint) + 0.35F * grain(uv - shift, 3.1F, footprint) +
         0.35F * grain(uv + 0.7F * shift, 11.7F, footprint);
}

Vector3f Painter::sky(const Vector3f& direction) const {
  const float up = std::max(direction.z(), 0.0F);
  Vector3f colour = blend({0.80F, 0.85F, 0.90F}, {0.36F, 0.56F, 0.84F}, std::min(1.0F, 1.6F * up));
  const float scale = 1.0F / (up + 0.18F);
  const float x = direction.x() * scale;
  const float y = direction.y() * scale;
  const float cloud = 0.5F + 0.3F * grain_.soft(x / 23, y / 23) + 0.17F * grain_.soft(x / 7, y / 7) +
                      0.08F * grain_.soft(y / 2, x / 2);
  const float cover = std::clamp((cloud - 0.45F) * 5.0F, 0.0F, 1.0F);
  return blend(colour, Vector3f::Constant(0.98F - 0.25F * std::clamp(cloud - 0.5F, 0.0F, 1.0F)),
               0.85F * cover);
}

Vector3f Painter::litter(const Vector3f& ground, const Vector2f& p, float w) const {
  if (w > 0.08F) return ground;
  constexpr float kCell = 0.45F;
  const int i = whole(p.x() / kCell);
  const int j = whole(p.y() / kCell);
  const auto bits = mix(index(i), index(j), seed_);
  if (unit(bits) > 0.22F) return ground;  // one fallen leaf or scrap of paper in some of the cells
  const Vector2f centre((static_cast<float>(i) + between(mix(bits, 1), 0.25F, 0.75F)) * kCell,
                        (static_cast<float>(j) + between(mix(bits, 2), 0.25F, 0.75F)) * kCell);
  const float angle = between(mix(bits, 3), 0, 6.28F);
  const Vector2f d = p - centre;
  const float a = (std::cos(angle) * d.x() + std::sin(angle) * d.y()) / between(mix(bits, 4), 0.035F, 0.085F);
  const float b = (-std::sin(angle) * d.x() + std::cos(angle) * d.y()) / 0.035F;
  const float cover = std::clamp((1.0F - std::sqrt(a * a + b * b)) * 0.045F / w + 0.5F, 0.0F, 1.0F);
  const float kind = unit(mix(bits, 5));
  const Vector3f colour =
      kind < 0.15F ? Vector3f(0.85F, 0.85F, 0.83F) : Vector3f(0.55F * kind + 0.1F, 0.34F - 0.1F * kind, 0.1F);
  return blend(ground, colour, cover * std::min(1.0F, 0.06F / w));
}

Vector3f Painter::pavement(const Spot& spot) const {
  const Vector2f& p = spot.point.z() < 1.0F ? Vector2f(spot.point.head<2>()) : spot.uv;
  const float w = spot.footprint;
  constexpr float kStone = 0.5F;
  const float row = simulation::floor(p.y() / kStone);
  const Vector2f q(p.x() / kStone + 0.5F * std::fmod(std::abs(row), 2.0F), p.y() / kStone);
  const int i = whole(q.x());
  const auto bits = mix(index(i), index(static_cast<int>(row)), seed_);
  const Vector2f in((q.x() - static_cast<float>(i)) * kStone, (q.y() - row) * kStone);
  const float joint = 0.014F;
  const float inside = span(in.x(), joint, kStone, w) * span(in.y(), joint, kStone, w);
  const float tone = 0.62F + (unit(bits) < 0.06F ? -0.17F : between(mix(bits, 1), -0.07F, 0.07F)) +
                     0.15F * mottle(p, w, seed_) +
                     0.1F * std::min(0.0F, cracks_.sample(p.x() / 4, p.y() / 4, w / 4));
  const Vector3f stone = tone * Vector3f(1.0F, 0.97F, 0.91F);
  return litter(blend(Vector3f(0.3F, 0.28F, 0.25F) * (0.9F + 0.4F * grain(p, 0.6F, w)), stone, inside), p, w);
}

// Every tile has the same veins.
Vector3f Painter::tiles(const Spot& spot) const {
  constexpr float kTile = 0.4F;
  const float w = spot.footprint;
  const Vector2f q = spot.uv / kTile;
  const Vector2f in(q.x() - simulation::floor(q.x()), q.y() - simulation::floor(q.y()));
  const float joint = 0.012F;
  const float inside =
      span(in.x(), joint, 1.0F - joint, w / kTile) * span(in.y(), joint, 1.0F - joint, w / kTile);
  const Vector2f veins = kTile * in + Vector2f(3.1F, 7.7F);
  const float tone = 1.1F + 0.35F * grain(veins, 0.47F, w) + 0.15F * cracks_.sample(veins.x(), veins.y(), w);
  return blend(Vector3f(0.55F, 0.54F, 0.5F), tone * Vector3f(1.0F, 0.98F, 0.93F), inside);
}

Vector3f Painter::sign(const Surface& surface, const Spot& spot) const {
  const Vector2f c = spot.uv - 0.5F * surface.size;
  const float half = 0.5F * surface.size.x();
  const float r = c.norm() / half;
  const float w = spot.footprint / half;
  const Vector3f white(0.92F, 0.92F, 0.92F);
  const Vector3f red(0.75F, 0.08F, 0.1F);
  const Vector3f blue(0.1F, 0.25F, 0.62F);
  const Vector3f black(0.08F, 0.08F, 0.08F);
  const float bar = span(c.y() / half, -0.18F, 0.18F, w) * span(c.x() / half, -0.62F, 0.62F, w);
  switch (surface.seed % 4) {
    case 0:
      return blend(red, white, bar);  // no entry
    case 1:
      return blend(blend(white, red, span(r, 0.72F, 9.0F, w)), black, bar * 0.9F);
    case 2: {  // parking
      const float stem = span(c.x() / half, -0.35F, -0.12F, w) * span(c.y() / half, -0.65F, 0.65F, w);
      const float bow = span((c / half - Vector2f(0.0F, 0.28F)).norm(), 0.16F, 0.37F, w) *
                        span(c.x() / half, -0.2F, 1.0F, w);
      return blend(blue, white, std::max(stem, bow));
    }
    default: {  // a warning
      const float tip = std::abs(c.x()) / half + 0.5F * (c.y() / half + 1.0F);
      const Vector3f face = blend({0.85F, 0.7F, 0.1F}, black, span(tip, 0.62F, 0.8F, w));
      return blend(face, black, span(c.x() / half, -0.09F, 0.09F, w) * span(c.y() / half, -0.6F, 0.1F, w));
    }
  }
}

Vector3f Painter::car_paint(const Surface& surface, const Spot& spot) const {
  const float x = spot.uv.x();
  const float z = spot.uv.y();
  const float w = spot.footprint;
  Vector3f colour = surface.colour * (1.0F + 0.06F * grain(spot.uv, 2.3F, w));
  if (std::abs(x) > 5.0F) return colour;  // roof and bumpers have no seams
  const float length = surface.size.x();
  const float belt = surface.size.y();
  float seam = 0.0F;
  for (const float door : {0.20F * length, -0.03F * length, -0.23F * length}) {
    seam = std::max(seam, span(x, door - 0.012F, door + 0.012F, w) * span(z, 0.3F, belt, w));
  }
  seam = std::max(seam, span(z, 0.28F, 0.31F, w) * span(x, -0.22F * length, 0.2F * length, w));
  for (const float door : {0.01F * length, -0.19F * length}) {  // handles
    seam = std::max(seam, span(x, door - 0.08F, door + 0.08F, w) * span(z, belt - 0.22F, belt - 0.18F, w));
  }
  for (const float axle : {-0.31F * length, 0.3F * length}) {  // wheel arches
    seam = std::max(seam, span((Vector2f(x - axle, z - 0.32F)).norm(), -1.0F, 0.4F, w));
  }
  return blend(colour, Vector3f::Constant(0.06F), seam);
}

Vector3f Painter::cloth(const Surface& surface, const Spot& spot) const {
  const Vector2f& uv = spot.uv;
  const float w = spot.footprint;
  const float fold = 1.0F + 0.22F * grain(uv + Vector2f(between(surface.seed, 0, 9), 0), 0.7F, w);
  const Vector3f other(0.9F - 0.6F * surface.colour.z(), 0.85F - 0.6F * surface.colour.x(),
                       0.85F - 0.6F * surface.colour.y());
  const auto wave = [&](float value, float period) {
    const float phase = value / period - simulation::floor(value / period);
    const float fade = std::clamp(1.5F - w / period * 2.0F, 0.0F, 1.0F);
    return 0.5F + (span(phase, 0.0F, 0.5F, w / period) - 0.5F) * fade;
  };
  float pattern = 0.0F;
  switch (surface.seed % 8) {
    case 1:
      pattern = wave(uv.y(), 0.12F);
      break;
    case 3:
      pattern = wave(uv.x(), 0.4F);
      break;
    case 5:
      pattern = 0.6F * wave(uv.x(), 0.11F) * wave(uv.y(), 0.11F);
      break;
    case 7:
      pattern = span(uv.y(), 0.18F, 0.32F, w);
      break;
    default:
      break;
  }
  return fold * blend(surface.colour, other, pattern);
}

Vector3f Painter::albedo(const Surface& surface, const Spot& spot) const {
  const float w = spot.footprint;
  const Vector2f& uv = spot.uv;
  switch (surface.material) {
    case Material::kRoad:
      return road(spot);
    case Material::kPavement:
      return pavement(spot);
    case Material::kTiles:
      return tiles(spot);
    case Material::kFacade:
      return facade(surface, spot);
    case Material::kSign:
      return sign(surface, spot);
    case Material::kPaint:
      return car_paint(surface, spot);
    case Material::kCloth:
      return cloth(surface, spot);
    case Material::kGlass: {
      const float streak = 0.5F + 0.5F * grain(spot.point.head<2>(), 7.0F, w);
      return Vector3f(0.10F, 0.12F, 0.14F) + 0.1F * streak * Vector3f(0.9F, 1.0F, 1.1F);
    }
    case Material::kKerb: {
      const Vector2f p(spot.point.x() + spot.point.y(), spot.point.z());
      const float joint = span(p.x() - simulation::floor(p.x()), 0.012F, 1.0F, w);
      return surface.colour * (surface.seed == 7 ? 1.15F : 1.0F) *
             (0.75F + 0.25F * joint + 0.2F * mottle(p, w, 9));
    }
    case Material::kRoof: {
      const float row = simulation::floor(uv.y() / 0.28F);
      const float column = simulation::floor(uv.x() / 0.24F + 0.5F * std::fmod(row, 2.0F));
      const auto bits = mix(index(static_cast<int>(row)), index(static_cast<int>(column)), surface.seed);
      const float in = uv.y() / 0.28F - row;
      return surface.colour * (0.8F + 0.35F * unit(bits) + 0.2F * grain(uv, 2.3F, w)) *
             (0.6F + 0.4F * span(in, 0.12F, 2, w * 3));
    }
    case Material::kBark: {
      const Vector2f stretched(uv.x() * 3.0F, uv.y() * 0.7F);
      const Vector3f base = surface.colour.x() == 0.5F && surface.colour.z() == 0.5F
                                ? Vector3f(0.33F, 0.27F, 0.21F)
                                : surface.colour;
      return base * (1.0F + 0.55F * grain(stretched, 0.9F, w * 1.5F));
    }
    case Material::kFoliage: {
      const float light = 0.62F * leaves_.sample(uv.x() / 1.7F, uv.y() / 1.7F, w / 1.7F) +
                          0.3F * grain(uv, 3.3F, w) + between(surface.seed, -0.1F, 0.1F);
      return surface.colour.cwiseProduct(
          Vector3f(1.0F + 1.05F * light, 1.0F + 0.9F * light, 1.0F + 0.6F * light));
    }
    case Material::kGrass: {
      const float tone = 1.0F + 0.5F * grain(uv, 0.5F, w) + 0.4F * mottle(uv, w, surface.seed);
      return litter(tone * Vector3f(0.27F, 0.38F, 0.14F), uv, w);
    }
    case Material::kPlaster:
      return surface.colour * (1.0F + 0.03F * mottle(uv, w, surface.seed));
    case Material::kPlain:
      return surface.colour * (1.0F + 0.12F * grain(uv, 0.9F, w));
  }
  return surface.colour;
}

}  // namespace roslam::simulation
