// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_noise.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace roslam::simulation {
namespace {

constexpr int kSize = 512;  // pixels along a side of the finest level

float smooth(float t) { return t * t * (3.0F - 2.0F * t); }

std::uint32_t cell(int i) { return static_cast<std::uint32_t>(i); }

// Value noise in [-1, 1] that repeats after `period` cells.
float periodic_noise(float x, float y, int period, std::uint32_t seed) {
  const int ix = whole(x);
  const int iy = whole(y);
  const float fx = smooth(x - static_cast<float>(ix));
  const float fy = smooth(y - static_cast<float>(iy));
  const auto corner = [&](int i, int j) { return unit(mix(cell(i % period), cell(j % period), seed)); };
  const float low = corner(ix, iy) * (1 - fx) + corner(ix + 1, iy) * fx;
  const float high = corner(ix, iy + 1) * (1 - fx) + corner(ix + 1, iy + 1) * fx;
  return 2.0F * (low * (1 - fy) + high * fy) - 1.0F;
}

// Adds a filled ellipse, wrapped around the edges of the tile.
void stamp(std::vector<float>& image, float cx, float cy, float a, float b, float angle, float value,
           bool replace) {
  const int reach = static_cast<int>(std::ceil(std::max(a, b)));
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const float u = (c * static_cast<float>(dx) + s * static_cast<float>(dy)) / a;
      const float v = (-s * static_cast<float>(dx) + c * static_cast<float>(dy)) / b;
      const float r = u * u + v * v;
      if (r > 1.0F) continue;
      const int x = (static_cast<int>(cx) + dx) & (kSize - 1);
      const int y = (static_cast<int>(cy) + dy) & (kSize - 1);
      float& pixel = image[static_cast<std::size_t>(y * kSize + x)];
      pixel = replace ? value + 0.35F * v - 0.3F * r : pixel + value;
    }
  }
}

std::vector<float> octaves(std::uint32_t seed, float persistence) {
  std::vector<float> image(kSize * kSize, 0.0F);
  float amplitude = 1.0F;
  for (int period = 4; period <= kSize / 2; period *= 2, amplitude *= persistence) {
    const float scale = static_cast<float>(period) / kSize;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        image[static_cast<std::size_t>(y * kSize + x)] +=
            amplitude * periodic_noise(static_cast<float>(x) * scale, static_cast<float>(y) * scale, period,
                                       mix(seed, cell(period)));
      }
    }
  }
  return image;
}

std::vector<float> grain(std::uint32_t seed) {
  std::vector<float> image = octaves(seed, 0.85F);
  Dice dice(seed);
  for (int i = 0; i < 5200; ++i) {  // chips of stone, gravel, spots: corners of several sizes
    const float r = 1.2F + 7.0F * std::pow(dice.between(0, 1), 5.0F);
    const float x = dice.between(0, kSize);
    const float y = dice.between(0, kSize);
    const float shape = dice.between(0.5F, 1.0F);
    const float angle = dice.between(0, 3.14F);
    stamp(image, x, y, r, r * shape, angle, dice.chance(0.55F) ? -1.7F : 1.7F, false);
  }
  return image;
}

std::vector<float> cracks(std::uint32_t seed) {
  constexpr int kCells = 9;
  std::vector<float> image(kSize * kSize, 0.0F);
  const std::vector<float> bend = octaves(mix(seed, 5), 0.6F);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const auto at = static_cast<std::size_t>(y * kSize + x);
      const float px = (static_cast<float>(x) + 14.0F * bend[at]) * kCells / kSize;
      const float py = (static_cast<float>(y) + 14.0F * bend[(at + 7777) % bend.size()]) * kCells / kSize;
      const int ix = static_cast<int>(simulation::floor(px));
      const int iy = static_cast<int>(simulation::floor(py));
      float nearest = 9.0F;
      float second = 9.0F;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const auto bits = mix(cell((ix + i + kCells) % kCells), cell((iy + j + kCells) % kCells), seed);
          const float dx = static_cast<float>(ix + i) + unit(bits) - px;
          const float dy = static_cast<float>(iy + j) + unit(mix(bits)) - py;
          const float d = std::sqrt(dx * dx + dy * dy);
          second = std::min(second, std::max(nearest, d));
          nearest = std::min(nearest, d);
        }
      }
      image[at] = -std::clamp(1.0F - (second - nearest) / 0.045F, 0.0F, 1.0F);
    }
  }
  return image;
}

std::vector<float> leaves(std::uint32_t seed) {
  std::vector<float> image = octaves(seed, 0.6F);
  Dice dice(seed);
  for (int i = 0; i < 2600; ++i) {  // later leaves cover earlier ones and are brighter
    const float r = dice.between(7.0F, 15.0F);
    const float x = dice.between(0, kSize);
    const float y = dice.between(0, kSize);
    const float angle = dice.between(0, 6.28F);
    const float light = -1.6F + 2.8F * static_cast<float>(i) / 2600.0F + dice.between(-0.9F, 0.9F);
    stamp(image, x, y, r, 0.5F * r, angle, light, true);
  }
  return image;
}

}  // namespace

float value_noise(float x, float y, std::uint32_t seed) {
  const float bx = simulation::floor(x);
  const float by = simulation::floor(y);
  const int ix = static_cast<int>(bx);
  const int iy = static_cast<int>(by);
  const float fx = smooth(x - bx);
  const float fy = smooth(y - by);
  const auto corner = [&](int i, int j) { return unit(mix(cell(i), cell(j), seed)); };
  const float low = corner(ix, iy) * (1 - fx) + corner(ix + 1, iy) * fx;
  const float high = corner(ix, iy + 1) * (1 - fx) + corner(ix + 1, iy + 1) * fx;
  return low * (1 - fy) + high * fy;
}

DetailTexture::DetailTexture(Detail kind, std::uint32_t seed) {
  std::vector<float> image = kind == Detail::kGrain    ? grain(seed)
                             : kind == Detail::kCracks ? cracks(seed)
                                                       : leaves(seed);
  if (kind != Detail::kCracks) {  // mean 0, two deviations reach 1
    double sum = 0;
    double squares = 0;
    for (const float v : image) {
      sum += v;
      squares += static_cast<double>(v) * v;
    }
    const auto n = static_cast<double>(image.size());
    const auto mean = static_cast<float>(sum / n);
    const auto deviation = static_cast<float>(std::sqrt(squares / n - sum / n * (sum / n)));
    for (float& v : image) v = (v - mean) / (2.0F * deviation);
  }
  int size = kSize;
  for (auto& level : levels_) {
    level.resize(image.size());
    std::transform(image.begin(), image.end(), level.begin(), [](float v) {
      return static_cast<std::int8_t>(std::lround(std::clamp(v * 80.0F, -127.0F, 127.0F)));
    });
    if (size == 1) break;
    size /= 2;
    std::vector<float> half(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const auto at = static_cast<std::size_t>(4 * y * size + 2 * x);
        const auto below = at + static_cast<std::size_t>(2 * size);
        half[static_cast<std::size_t>(y * size + x)] =
            0.25F * (image[at] + image[at + 1] + image[below] + image[below + 1]);
      }
    }
    image = std::move(half);
  }
}

float DetailTexture::bilinear(int level, float u, float v) const {
  const int size = kSize >> level;
  const float x = u * static_cast<float>(size) - 0.5F;
  const float y = v * static_cast<float>(size) - 0.5F;
  const float bx = simulation::floor(x);
  const float by = simulation::floor(y);
  const float fx = x - bx;
  const float fy = y - by;
  const int mask = size - 1;
  const int x0 = static_cast<int>(bx) & mask;
  const int y0 = (static_cast<int>(by) & mask) * size;
  const int x1 = (x0 + 1) & mask;
  const int y1 = (y0 + size) & (size * size - 1);
  const std::int8_t* data = levels_[static_cast<std::size_t>(level)].data();
  const auto at = [data](int i) { return static_cast<float>(data[i]); };
  const float low = at(y0 + x0) + (at(y0 + x1) - at(y0 + x0)) * fx;
  const float high = at(y1 + x0) + (at(y1 + x1) - at(y1 + x0)) * fx;
  return (low + (high - low) * fy) * (1.0F / 80.0F);
}

float DetailTexture::sample(float u, float v, float footprint) const {
  const float texels = std::max(footprint * kSize, 1.0F);
  // log2 from the bits of the number: its exponent, and its mantissa as the fraction between two levels
  const auto bits = std::bit_cast<std::uint32_t>(texels);
  const int level = static_cast<int>(bits >> 23) - 127;
  if (level >= kLevels - 2) return 0.0F;
  const float fraction = static_cast<float>(bits & 0x7fffffU) * (1.0F / 8388608.0F);
  // Levels are blended only around the middle between them, which saves a sample elsewhere.
  const float share = 2.0F * fraction - 0.5F;
  if (share <= 0.0F) return bilinear(level, u, v);
  if (share >= 1.0F) return bilinear(level + 1, u, v);
  const float fine = bilinear(level, u, v);
  return fine + (bilinear(level + 1, u, v) - fine) * share;
}

float DetailTexture::soft(float u, float v) const {
  constexpr int kSoftLevel = 4;
  return bilinear(kSoftLevel, u, v);
}

}  // namespace roslam::simulation
