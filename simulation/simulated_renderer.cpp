// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace roslam::simulation {
namespace {

const Vector3f sun_direction() { return Vector3f(0.33F, -0.42F, 0.845F).normalized(); }
constexpr float kLift = 0.004F;             // metres off the surface where shadow rays start
constexpr float kHaze = 700.0F;             // metres over which the air takes on the colour of the horizon
constexpr std::int32_t kMovable = 1 << 24;  // marks parts of movable objects, and parts in shadow
constexpr std::int32_t kShadow = 1 << 25;
constexpr float kEdge = 0.04F;  // relative step of depth that makes an edge

// Those of the given pixels that lie on an edge of an object part.
std::vector<cv::Point> edges_of(const Image& image, const cv::Mat& where) {
  std::vector<cv::Point> edges;
  const int width = image.parts.cols;
  const int height = image.parts.rows;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!where.empty() && where.at<std::uint8_t>(y, x) == 0) continue;
      const auto part = image.parts.at<std::int32_t>(y, x);
      const float depth = image.depth.at<float>(y, x);
      const auto differs = [&](int i, int j) {
        if (i < 0 || j < 0 || i >= width || j >= height) return false;
        if (image.parts.at<std::int32_t>(j, i) != part) return true;
        return std::abs(image.depth.at<float>(j, i) - depth) > kEdge * depth;
      };
      if (differs(x - 1, y) || differs(x + 1, y) || differs(x, y - 1) || differs(x, y + 1))
        edges.emplace_back(x, y);
    }
  }
  return edges;
}

cv::Vec3f bgr(const Vector3f& colour) {
  const Vector3f c = 255.0F * colour.cwiseMax(0.0F).cwiseMin(1.0F);
  return {c.z(), c.y(), c.x()};
}

}  // namespace

struct Renderer::Eye {
  Vector3f position;
  Eigen::Matrix3f R_world_camera;
  float cx, cy, inverse_fx, inverse_fy;
};

struct Renderer::Hits {
  int count = 0;
  std::array<Vector3f, kPacket> direction;  // one metre deep
  std::array<float, kPacket> depth;         // 0 where there is only sky
  std::array<const Surface*, kPacket> surface;
  std::array<std::int32_t, kPacket> part;
  std::array<Vector3f, kPacket> point;
  std::array<Vector3f, kPacket> normal;
  std::array<Vector2f, kPacket> uv;
  std::array<bool, kPacket> touched;
  std::array<bool, kPacket> sunlit;
  std::array<bool, kPacket> covered;  // ground below a movable object, which the sky does not light
};

Renderer::Renderer(const CityPlan& plan, Mesh scene, const Camera& camera, std::uint32_t seed)
    : camera_(camera), plan_(plan), scene_(std::move(scene)), painter_(plan_, seed) {
  scene_tracer_.build(scene_, false);
  movables_tracer_.build(movables_, true);
}

void Renderer::set_movables(Mesh movables) {
  movables_ = std::move(movables);
  movables_tracer_.build(movables_, true);
}

void Renderer::trace(const Eye& eye, const Points& points, bool movables, Hits& hits) const {
  RayPacket rays;
  hits.count = points.count;
  for (std::size_t i = 0; i < kPacket; ++i) {
    const Vector3f local((points.x[i] - eye.cx) * eye.inverse_fx, (points.y[i] - eye.cy) * eye.inverse_fy,
                         1.0F);
    hits.direction[i] = eye.R_world_camera * local;
    rays.ox[i] = eye.position.x();
    rays.oy[i] = eye.position.y();
    rays.oz[i] = eye.position.z();
    rays.dx[i] = hits.direction[i].x();
    rays.dy[i] = hits.direction[i].y();
    rays.dz[i] = hits.direction[i].z();
    rays.near[i] = 0.05F;
    rays.far[i] = 1e4F;
    rays.active[i] = static_cast<int>(i) < points.count ? -1 : 0;
  }
  HitPacket fixed;
  HitPacket movable;
  scene_tracer_.intersect(rays, fixed);
  movable.triangle.fill(kMiss);
  if (movables) {
    for (std::size_t i = 0; i < kPacket; ++i) {
      if (fixed.triangle[i] != kMiss) rays.far[i] = fixed.distance[i];
    }
    movables_tracer_.intersect(rays, movable);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.count); ++i) {
    const bool moves = movable.triangle[i] != kMiss;
    const HitPacket& hit = moves ? movable : fixed;
    const Mesh& mesh = moves ? movables_ : scene_;
    hits.touched[i] = moves;
    hits.sunlit[i] = false;
    hits.covered[i] = false;
    hits.surface[i] = nullptr;
    hits.depth[i] = 0.0F;
    hits.part[i] = 0;
    if (hit.triangle[i] == kMiss) continue;
    const auto& corner = mesh.triangles[hit.triangle[i]];
    const float u = hit.u[i];
    const float v = hit.v[i];
    const float t = 1.0F - u - v;
    const auto surface = mesh.surface_of[hit.triangle[i]];
    hits.surface[i] = &mesh.surfaces[surface];
    hits.part[i] = static_cast<std::int32_t>(surface + 1) | (moves ? kMovable : 0);
    hits.depth[i] = hit.distance[i];
    hits.point[i] = eye.position + hit.distance[i] * hits.direction[i];
    hits.uv[i] = t * mesh.uvs[corner[0]] + u * mesh.uvs[corner[1]] + v * mesh.uvs[corner[2]];
    const Vector3f normal =
        t * mesh.normals[corner[0]] + u * mesh.normals[corner[1]] + v * mesh.normals[corner[2]];
    hits.normal[i] = normal.dot(hits.direction[i]) > 0 ? Vector3f(-normal) : normal;
  }
}

// Finds which hit points are sunlit, and which lie below a movable object.
void Renderer::light(const Eye& eye, bool movables, Hits& hits) const {
  RayPacket rays;
  const auto aim = [&](const Vector3f& towards, float reach, auto&& wanted) {
    bool any = false;
    for (std::size_t i = 0; i < kPacket; ++i) {
      const bool active = static_cast<int>(i) < hits.count && hits.surface[i] != nullptr && wanted(i);
      rays.active[i] = active ? -1 : 0;
      any = any || active;
      const float lift = kLift + 2e-4F * (active ? hits.depth[i] : 0.0F);
      const Vector3f origin = active ? Vector3f(hits.point[i] + lift * hits.normal[i]) : eye.position;
      rays.ox[i] = origin.x();
      rays.oy[i] = origin.y();
      rays.oz[i] = origin.z();
      rays.dx[i] = towards.x();
      rays.dy[i] = towards.y();
      rays.dz[i] = towards.z();
      rays.near[i] = 0.0F;
      rays.far[i] = reach;
    }
    return any;
  };
  const Vector3f sun = sun_direction();
  if (aim(sun, 100.0F, [&](std::size_t i) { return hits.normal[i].dot(sun) > 0.0F; })) {
    scene_tracer_.block(rays);
    const auto open = rays.active;
    if (movables) movables_tracer_.block(rays);
    for (std::size_t i = 0; i < kPacket; ++i) {
      hits.sunlit[i] = rays.active[i] != 0;
      if (hits.sunlit[i] != (open[i] != 0)) hits.touched[i] = true;
    }
  }
  // A point below a movable object lies in its shadow too, or in that of a house.
  const auto on_ground = [&](std::size_t i) {
    return !hits.sunlit[i] && hits.point[i].z() < 0.2F && (hits.part[i] & kMovable) == 0 &&
           hits.normal[i].z() > 0.5F;
  };
  if (movables && aim({0, 0, 1}, 1.2F, on_ground)) {
    const auto before = rays.active;
    movables_tracer_.block(rays);
    for (std::size_t i = 0; i < kPacket; ++i) {
      if (before[i] == 0 || rays.active[i] != 0) continue;
      hits.covered[i] = true;
      hits.touched[i] = true;
    }
  }
}

Vector3f Renderer::shade(const Eye& eye, const Hits& hits, std::size_t i) const {
  const float length = hits.direction[i].norm();
  const Vector3f towards = hits.direction[i] / length;
  if (hits.surface[i] == nullptr) return painter_.sky(towards);
  const Surface& surface = *hits.surface[i];
  const Vector3f normal = hits.normal[i].normalized();
  const float facing = std::max(-normal.dot(towards), 0.04F);
  // Between the width and the height of a pixel on a slanted surface: balances aliasing against blur.
  const float footprint = hits.depth[i] * eye.inverse_fx / (std::sqrt(facing) * (0.8F + 0.2F * facing));
  const Vector3f albedo = painter_.albedo(surface, {hits.uv[i], hits.point[i], footprint});
  const float lambert = hits.sunlit[i] ? normal.dot(sun_direction()) : 0.0F;
  const float sky = (hits.covered[i] ? 0.35F : 1.0F) * (0.47F + 0.13F * normal.z());
  const Vector3f incoming =
      sky * Vector3f(0.97F, 1.0F, 1.06F) + 0.72F * lambert * Vector3f(1.05F, 1.0F, 0.9F);
  Vector3f colour = albedo.cwiseProduct(incoming);
  if (surface.material == Material::kGlass || surface.material == Material::kPaint) {
    const Vector3f mirrored = towards + 2.0F * facing * normal;
    const float rim = 1.0F - facing;
    const float strength =
        (surface.material == Material::kGlass ? 0.14F : 0.05F) + 0.5F * rim * rim * rim * rim;
    const float up = std::clamp(0.5F + 1.5F * mirrored.z(), 0.15F, 1.0F);
    colour += strength * up * Vector3f(0.75F, 0.84F, 0.95F);
    const float gleam = std::max(0.0F, mirrored.dot(sun_direction()));
    if (hits.sunlit[i]) colour += Vector3f::Constant(0.8F * std::pow(gleam, 60.0F));
  }
  const float haze = hits.depth[i] / (hits.depth[i] + kHaze);
  return colour + haze * (Vector3f(0.78F, 0.82F, 0.87F) - colour);
}

// Points come in groups of `group` within one pixel. Those of a group that hit the same part are shaded once:
// the textures are already filtered to a pixel.
void Renderer::sample(const Eye& eye, const Points& points, int group, bool movables,
                      Samples& samples) const {
  Hits hits;
  trace(eye, points, movables, hits);
  light(eye, movables, hits);
  for (std::size_t i = 0; i < static_cast<std::size_t>(points.count); ++i) {
    Sample& s = samples[i];
    const auto same = [&](std::size_t j) {
      return hits.part[j] == hits.part[i] && hits.sunlit[j] == hits.sunlit[i] &&
             hits.covered[j] == hits.covered[i] && hits.surface[i] != nullptr &&
             hits.normal[j].dot(hits.normal[i]) > 0.97F &&
             std::abs(hits.depth[j] - hits.depth[i]) < kEdge * hits.depth[i];
    };
    std::size_t twin = i - i % static_cast<std::size_t>(group);
    while (twin < i && !same(twin)) ++twin;
    s.colour = twin < i ? samples[twin].colour : shade(eye, hits, i);
    s.depth = hits.depth[i];
    s.part = hits.part[i] | (hits.sunlit[i] ? 0 : kShadow);
    s.instance = hits.surface[i] != nullptr ? hits.surface[i]->instance : std::uint16_t{0};
    s.label = hits.surface[i] != nullptr ? hits.surface[i]->label : std::uint8_t{kSkyLabel};
    s.touched = hits.touched[i];
  }
}

void Renderer::draw_centres(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables,
                            Image& image) const {
  Samples samples;
  for (std::size_t first = 0; first < pixels.size(); first += kPacket) {
    Points points;
    points.count = static_cast<int>(std::min<std::size_t>(kPacket, pixels.size() - first));
    for (std::size_t i = 0; i < kPacket; ++i) {
      const cv::Point& pixel = pixels[std::min(first + i, pixels.size() - 1)];
      points.x[i] = static_cast<float>(pixel.x);
      points.y[i] = static_cast<float>(pixel.y);
    }
    sample(eye, points, 1, movables, samples);
    for (std::size_t i = 0; i < static_cast<std::size_t>(points.count); ++i) {
      const cv::Point& pixel = pixels[first + i];
      const Sample& s = samples[i];
      image.colour.at<cv::Vec3f>(pixel) = bgr(s.colour);
      image.depth.at<float>(pixel) = s.depth;
      image.labels.at<std::uint8_t>(pixel) = s.label;
      image.instances.at<std::uint16_t>(pixel) = s.instance;
      image.parts.at<std::int32_t>(pixel) = s.part;
      image.touched.at<std::uint8_t>(pixel) = s.touched ? 255 : 0;
    }
  }
}

// Antialiasing: averages the colour of each pixel's centre, already rendered, with two more samples.
void Renderer::smooth_edges(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables,
                            Image& image) const {
  constexpr std::size_t kPerPixel = 2;
  constexpr std::size_t kPixels = kPacket / kPerPixel;
  constexpr float kOffsets[kPerPixel][2] = {{-0.35F, 0.22F}, {0.22F, -0.35F}};
  Samples samples;
  for (std::size_t first = 0; first < pixels.size(); first += kPixels) {
    Points points;
    points.count = static_cast<int>(kPerPixel * std::min(kPixels, pixels.size() - first));
    for (std::size_t i = 0; i < kPacket; ++i) {
      const cv::Point& pixel = pixels[std::min(first + i / kPerPixel, pixels.size() - 1)];
      points.x[i] = static_cast<float>(pixel.x) + kOffsets[i % kPerPixel][0];
      points.y[i] = static_cast<float>(pixel.y) + kOffsets[i % kPerPixel][1];
    }
    sample(eye, points, kPerPixel, movables, samples);
    for (std::size_t j = 0; j < static_cast<std::size_t>(points.count) / kPerPixel; ++j) {
      const cv::Point& pixel = pixels[first + j];
      cv::Vec3f& colour = image.colour.at<cv::Vec3f>(pixel);
      for (std::size_t i = j * kPerPixel; i < (j + 1) * kPerPixel; ++i) {
        colour += bgr(samples[i].colour);
        if (samples[i].touched) image.touched.at<std::uint8_t>(pixel) = 255;
      }
      colour *= 1.0F / (kPerPixel + 1);
    }
  }
}

Renderer::Eye Renderer::eye_at(const SE3& T_world_camera) const {
  return {T_world_camera.translation().cast<float>(),
          T_world_camera.rotation().toRotationMatrix().cast<float>(),
          static_cast<float>(camera_.cx),
          static_cast<float>(camera_.cy),
          static_cast<float>(1.0 / camera_.fx),
          static_cast<float>(1.0 / camera_.fy)};
}

Image Renderer::draw(const SE3& T_world_camera) const {
  const cv::Size size(camera_.width, camera_.height);
  Image image{cv::Mat(size, CV_32FC3), cv::Mat(size, CV_32FC1), cv::Mat(size, CV_8UC1),
              cv::Mat(size, CV_16UC1), cv::Mat(size, CV_32SC1), cv::Mat(size, CV_8UC1)};
  const Eye eye = eye_at(T_world_camera);
  std::vector<cv::Point> pixels;  // in blocks of 4 by 2, whose rays stay close together
  pixels.reserve(static_cast<std::size_t>(size.area()));
  for (int y = 0; y < size.height; y += 2) {
    for (int x = 0; x < size.width; x += 4) {
      for (int i = 0; i < 8; ++i) {
        const cv::Point pixel(x + i % 4, y + i / 4);
        if (pixel.x < size.width && pixel.y < size.height) pixels.push_back(pixel);
      }
    }
  }
  draw_centres(eye, pixels, true, image);
  smooth_edges(eye, edges_of(image, {}), true, image);
  return image;
}

Image Renderer::without_movables(const SE3& T_world_camera, const Image& image) const {
  Image background{image.colour.clone(),    image.depth.clone(), image.labels.clone(),
                   image.instances.clone(), image.parts.clone(), image.touched.clone()};
  const Eye eye = eye_at(T_world_camera);
  std::vector<cv::Point> pixels;
  for (int y = 0; y < image.touched.rows; ++y) {
    for (int x = 0; x < image.touched.cols; ++x) {
      if (image.touched.at<std::uint8_t>(y, x) != 0) pixels.emplace_back(x, y);
    }
  }
  draw_centres(eye, pixels, false, background);
  smooth_edges(eye, edges_of(background, image.touched), false, background);
  return background;
}

}  // namespace roslam::simulation
