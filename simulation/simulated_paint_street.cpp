// SPDX-License-Identifier: BSD-3-Clause
// Textures of the street: asphalt with its markings, and facades.
#include <algorithm>
#include <cmath>

#include "simulation/simulated_city.hpp"
#include "simulation/simulated_paint.hpp"
#include "simulation/simulated_paint_tools.hpp"

namespace roslam::simulation {
namespace {

float nearest(const std::vector<float>& streets, float value) {
  float best = 1e9F;
  for (const float street : streets) {
    if (std::abs(value - street) < std::abs(best)) best = value - street;
  }
  return best;
}

}  // namespace

// White paint on the road: how much of it covers the point.
float Painter::marking(const Vector2f& p, float w) const {
  const float across_x = nearest(plan_.streets_along_x, p.y());  // offset from the nearest street along x
  const float across_y = nearest(plan_.streets_along_y, p.x());
  const bool on_x = std::abs(across_x) < plan_.kerb + 0.5F;
  const bool on_y = std::abs(across_y) < plan_.kerb + 0.5F;
  if (on_x && on_y) return 0.0F;
  const float across = on_x ? across_x : across_y;
  const float along = on_x ? p.x() : p.y();
  const float to_crossing =
      std::abs(on_x ? across_y : across_x) - plan_.kerb;  // from the edge of the crossing
  float paint = 0.0F;
  if (to_crossing < 4.2F) {  // zebra stripes, then the line to stop at
    const float stripe = across - simulation::floor(across);
    paint = span(stripe, 0.25F, 0.75F, w) * span(to_crossing, 0.7F, 3.2F, w) *
            span(across, -plan_.kerb + 0.3F, plan_.kerb - 0.3F, w);
  } else {
    if (to_crossing < 5.0F) {
      paint = span(to_crossing, 4.3F, 4.75F, w) * span(std::abs(across), 0.1F, 3.0F, w);
    }
    const float dash = along - 6.0F * simulation::floor(along / 6.0F);
    paint = std::max(paint, span(across, -0.07F, 0.07F, w) * span(dash, 0.0F, 3.0F, w));
    // The bays for parking: a broken line, and a short stroke between bays.
    const float side = std::abs(across);
    const float bay = along - 6.2F * simulation::floor(along / 6.2F);
    paint = std::max(paint, span(side, 3.05F, 3.15F, w) * span(bay, 0.0F, 5.2F, w));
    paint = std::max(paint, span(side, 3.05F, 5.1F, w) * span(bay, 0.0F, 0.1F, w));
  }
  return paint;
}

Vector3f Painter::road(const Spot& spot) const {
  const Vector2f p = spot.point.head<2>();
  const float w = spot.footprint;
  const float blotches = mottle(p, w, seed_);
  float tone = 0.40F + 0.17F * blotches;
  // Repaired patches: rectangles of newer asphalt with a seam of tar.
  constexpr float kCell = 4.3F;
  const int i = whole(p.x() / kCell);
  const int j = whole(p.y() / kCell);
  const auto bits = mix(index(i), index(j), mix(seed_, 31));
  const Vector2f in(p.x() - static_cast<float>(i) * kCell, p.y() - static_cast<float>(j) * kCell);
  if (unit(bits) < 0.3F) {
    const Vector2f low(between(mix(bits, 1), 0.1F, 1.8F), between(mix(bits, 2), 0.1F, 1.8F));
    const Vector2f high(between(mix(bits, 3), 2.2F, 4.2F), between(mix(bits, 4), 2.2F, 4.2F));
    const auto inside = [&](float rim) {
      return span(in.x(), low.x() + rim, high.x() - rim, w) * span(in.y(), low.y() + rim, high.y() - rim, w);
    };
    const float newer = between(mix(bits, 5), -0.12F, 0.06F);
    tone += newer * inside(0.0F) - 0.13F * (inside(0.0F) - inside(0.05F));
  }
  // Cracks, where the road is old.
  const float age = 0.5F + 0.9F * grain_.soft(p.x() / 113, p.y() / 113);
  tone += 0.26F * std::clamp(2.5F * age - 0.9F, 0.0F, 1.0F) *
          cracks_.sample(p.x() / 6.3F, p.y() / 6.3F, w / 6.3F);
  tone -= 0.10F * std::clamp(3.0F * (0.5F + 0.9F * grain_.soft(p.y() / 37, p.x() / 37)) - 2.2F, 0.0F,
                             1.0F);  // oil
  Vector3f colour = tone * Vector3f(1.0F, 0.995F, 0.98F);
  const float wear = std::clamp(0.9F + 0.9F * blotches, 0.15F, 1.0F);
  colour = blend(colour, Vector3f(0.86F, 0.86F, 0.83F), wear * marking(p, w));
  // Manholes.
  if (unit(mix(bits, 9)) < 0.16F && w < 0.2F) {
    const Vector2f centre(between(mix(bits, 10), 0.6F, 3.7F), between(mix(bits, 11), 0.6F, 3.7F));
    const Vector2f d = in - centre;
    const float r = d.norm();
    const float lattice = span(d.x() / 0.09F - simulation::floor(d.x() / 0.09F), 0.3F, 1.0F, w / 0.09F) *
                          span(d.y() / 0.09F - simulation::floor(d.y() / 0.09F), 0.3F, 1.0F, w / 0.09F);
    colour = blend(colour, Vector3f::Constant(0.2F), span(r, -1, 0.36F, w));
    colour = blend(colour, Vector3f::Constant(0.3F + 0.2F * lattice), span(r, -1, 0.31F, w));
  }
  return litter(colour, p, w);
}

Vector3f Painter::wall(const FacadePlan& plan, const Spot& spot, std::uint32_t seed) const {
  const Vector2f& uv = spot.uv;
  const float w = spot.footprint;
  const float blotches = mottle(uv, w, seed);
  const float rain =
      grain({uv.x() * 2.5F, uv.y() * 0.3F}, 5.3F, w * 1.5F);  // streaks below sills and gutters
  if (!plan.brick) {
    const float crack = cracks_.sample(uv.x() / 5, uv.y() / 5, w / 5);
    return plan.wall *
           (1.0F + 0.22F * blotches + 0.09F * rain + 0.2F * crack * std::clamp(0.3F + blotches, 0.0F, 1.0F));
  }
  const float row = simulation::floor(uv.y() / 0.085F);
  const float x = uv.x() / 0.26F + 0.5F * std::fmod(std::abs(row), 2.0F);
  const float column = simulation::floor(x);
  const auto bits = mix(index(static_cast<int>(row)), index(static_cast<int>(column)), seed);
  const float fade = std::clamp(1.6F - w / 0.06F, 0.0F, 1.0F);
  const float brick =
      1.0F + (unit(bits) - 0.5F) * (unit(mix(bits)) < 0.12F ? 0.9F : 0.34F) * std::max(fade, 0.25F);
  const float inside =
      span((x - column) * 0.26F, 0.012F, 0.26F, w) * span(uv.y() - row * 0.085F, 0.012F, 0.085F, w);
  const Vector3f mortar = Vector3f(0.66F, 0.63F, 0.58F);
  const float cover = fade * inside + (1 - fade) * 0.82F;
  return blend(mortar, plan.wall * brick, cover) * (1.0F + 0.2F * blotches + 0.1F * rain);
}

// A window, `at` from its lower left corner.
Vector3f Painter::window(const FacadePlan& plan, const Vector2f& at, const Vector2f& size, float w,
                         std::uint32_t bits) const {
  // Behind the glass a dark room, a curtain or a blind; on it a pale reflection.
  Vector3f glass = Vector3f(0.13F, 0.16F, 0.2F) + 0.16F * Vector3f(0.7F, 0.9F, 1.1F) * (at.y() / size.y()) *
                                                      (0.6F + 0.8F * unit(mix(bits, 8)));
  glass *= 1.0F + 0.5F * grain(at + Vector2f(between(bits, 0, 9), 0), 4.0F, w);
  const float kind = unit(mix(bits, 1));
  if (kind < 0.45F) {
    const float open = between(mix(bits, 2), 0.15F, 0.5F) * size.x();
    const float curtain = std::max(span(at.x(), 0, open, w), span(at.x(), size.x() - open, size.x(), w));
    const float folds = 0.72F + 0.14F * std::sin(at.x() * 55.0F) * std::clamp(1.5F - w / 0.04F, 0.0F, 1.0F);
    glass = blend(glass, folds * Vector3f(0.92F, 0.88F - 0.2F * unit(mix(bits, 3)), 0.78F), 0.8F * curtain);
  } else if (kind < 0.65F) {
    const float drop = between(mix(bits, 2), 0.2F, 0.9F) * size.y();
    const float slat = at.y() / 0.07F - simulation::floor(at.y() / 0.07F);
    const float fade = std::clamp(1.5F - w / 0.035F, 0.0F, 1.0F);
    glass = blend(glass, Vector3f::Constant(0.68F - 0.18F * fade * span(slat, 0, 0.3F, w / 0.07F)),
                  span(at.y(), size.y() - drop, size.y(), w));
  } else if (kind < 0.78F) {  // a plant on the window sill
    const float r = (at - Vector2f(size.x() * between(mix(bits, 4), 0.3F, 0.7F), 0.3F)).norm();
    glass = blend(glass, {0.16F, 0.3F, 0.12F}, span(r + 0.08F * grain(at, 0.6F, w), -1, 0.24F, w));
  }
  const float rim = 0.07F;
  float bar = 1.0F - span(at.x(), rim, size.x() - rim, w) * span(at.y(), rim, size.y() - rim, w);
  bar = std::max(bar, span(at.x(), size.x() / 2 - 0.03F, size.x() / 2 + 0.03F, w));
  if ((bits & 64U) != 0) bar = std::max(bar, span(at.y(), size.y() * 0.68F, size.y() * 0.68F + 0.05F, w));
  const float shade =
      1.0F - 0.45F * span(at.y(), size.y() - 0.12F, 9.0F, std::max(w, 0.05F));  // under the lintel
  return shade * blend(glass, plan.frame, bar);
}

Vector3f Painter::shop(const FacadePlan& plan, const Vector2f& uv, float width, float w,
                       std::uint32_t seed) const {
  const float pane = width / std::max(1.0F, simulation::floor(width / 2.6F));
  const float column = simulation::floor(uv.x() / pane);
  const auto bits = mix(seed, index(static_cast<int>(column)));
  const Vector2f at(uv.x() - column * pane, uv.y());
  const Vector3f& base = plan.shop_colour;
  if (uv.y() > 2.75F) {  // the name of the shop: a row of letters
    const float letter = uv.x() / 0.32F;
    const float cell = simulation::floor(letter);
    const auto glyph = mix(mix(seed, 40), index(static_cast<int>(cell)));
    const Vector2f in((letter - cell) * 5.0F, (uv.y() - 2.95F) / 0.38F * 7.0F);
    const bool inside = in.y() > 0 && in.y() < 7 && in.x() < 4 && uv.x() > 0.5F && uv.x() < width * 0.7F &&
                        unit(mix(glyph, 3)) > 0.12F;
    const auto bit =
        static_cast<unsigned>(in.x()) + 4U * static_cast<unsigned>(std::max(in.y(), 0.0F) / 1.4F);
    const float ink =
        inside && (glyph >> (bit % 20U) & 1U) != 0 ? std::clamp(1.6F - w / 0.05F, 0.3F, 1.0F) : 0.0F;
    return blend(base * (1.0F + 0.2F * grain(uv, 2.1F, w)), {0.92F, 0.9F, 0.8F}, ink);
  }
  Vector3f goods = Vector3f(0.2F, 0.2F, 0.21F) * (1.0F + 0.8F * grain(uv, 1.9F, w));
  const float shelf = uv.y() / 0.55F;
  const auto item = mix(bits, index(static_cast<int>(shelf)), index(static_cast<int>(uv.x() / 0.31F)));
  if (unit(item) < 0.65F) {
    const float high = between(mix(item, 1), 0.3F, 0.85F);
    const float inside = span(shelf - simulation::floor(shelf), 0.06F, high, w / 0.55F) *
                         span(uv.x() / 0.31F - simulation::floor(uv.x() / 0.31F), 0.12F, 0.88F, w / 0.31F);
    goods = blend(goods,
                  {between(mix(item, 2), 0.15F, 0.8F), between(mix(item, 3), 0.15F, 0.7F),
                   between(mix(item, 4), 0.15F, 0.7F)},
                  0.75F * inside);
  }
  const bool door = unit(mix(bits, 5)) < 0.3F;
  const float foot = door ? 0.05F : 0.55F;
  const float opening = span(at.x(), 0.12F, pane - 0.12F, w) * span(at.y(), foot, 2.6F, w);
  const float bar = door ? span(at.x(), pane / 2 - 0.05F, pane / 2 + 0.05F, w) : 0.0F;
  return blend(base * (0.9F + 0.25F * grain(uv, 1.3F, w)), goods, opening * (1.0F - bar));
}

Vector3f Painter::facade(const Surface& surface, const Spot& spot) const {
  const FacadePlan plan = facade_plan(surface.seed, surface.size);
  const float u = spot.uv.x();
  const float v = spot.uv.y();
  const float w = spot.footprint;
  const auto seed = mix(surface.seed, static_cast<std::uint32_t>(surface.size.x() * 64.0F));
  if (surface.size.y() < 2.0F) return wall(plan, spot, seed);  // a garden wall
  if (plan.shop && v < plan.ground - 0.12F) return shop(plan, spot.uv, surface.size.x(), w, seed);
  const float column =
      std::clamp(simulation::floor(u / plan.column), 0.0F, static_cast<float>(plan.columns - 1));
  const float in = u - (column + 0.5F) * plan.column + plan.window_width / 2;
  const float storey = simulation::floor((v - plan.ground) / plan.storey);
  const bool ground = storey < 0;
  const float foot = ground ? 0.0F : plan.ground + storey * plan.storey;
  const bool door = ground && column == 0;
  const float base = foot + (door ? 0.28F : ground ? 1.1F : plan.sill);
  const float height = door ? 2.3F : plan.window_height;
  Vector3f colour = wall(plan, spot, seed);
  if (ground && !plan.brick) colour *= v < 0.7F ? 0.72F : 0.93F;  // the plinth
  if (!ground && storey >= static_cast<float>(plan.storeys)) return colour;
  const float surround =
      span(in, -0.12F, plan.window_width + 0.12F, w) * span(v, base - 0.05F, base + height + 0.12F, w);
  colour = blend(colour, plan.trim * (0.95F + 0.15F * grain(spot.uv, 1.1F, w)), surround);
  const float opening = span(in, 0, plan.window_width, w) * span(v, base, base + height, w);
  if (opening <= 0.0F) return colour;
  const auto bits = mix(seed, index(static_cast<int>(column)), index(static_cast<int>(storey)));
  if (door) {
    const Vector2f at(in, v - base);
    const float panel =
        span(at.x(), 0.15F, plan.window_width - 0.15F, w) * span(std::fmod(at.y(), 0.75F), 0.12F, 0.66F, w);
    return blend(colour, plan.shop_colour * (1.0F - 0.3F * panel + 0.15F * grain(at, 0.9F, w)), opening);
  }
  return blend(colour, window(plan, {in, v - base}, {plan.window_width, height}, w, bits), opening);
}

}  // namespace roslam::simulation
