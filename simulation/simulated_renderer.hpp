// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "simulation/simulated_city.hpp"
#include "simulation/simulated_mesh.hpp"
#include "simulation/simulated_paint.hpp"
#include "simulation/simulated_tracer.hpp"

namespace roslam::simulation {

/// A rendered image and the ground truth of each pixel, at its centre.
struct Image {
  cv::Mat colour;     ///< CV_32FC3, blue, green, red, 0 to 255
  cv::Mat depth;      ///< CV_32FC1, metres along the optical axis, 0 = sky
  cv::Mat labels;     ///< CV_8UC1, values of Label
  cv::Mat instances;  ///< CV_16UC1, number of the moving object, 0 = none
  cv::Mat parts;      ///< CV_32SC1, identifier of the object part; it changes at edges
  cv::Mat touched;    ///< CV_8UC1, not 0 where a movable object is visible or casts a shadow
};

/// Ray tracer for a static scene and the movable objects in it.
class Renderer {
 public:
  /// plan: which the textures of a city follow.
  Renderer(const CityPlan& plan, Mesh scene, const Camera& camera, std::uint32_t seed);

  /// Replaces the movable objects.
  void set_movables(Mesh movables);

  Image draw(const SE3& T_world_camera) const;

  /// The same image without the movable objects; only pixels that are `touched` are rendered again.
  Image without_movables(const SE3& T_world_camera, const Image& image) const;

 private:
  /// Image points, pixels.
  struct Points {
    RayPacket::Lanes<float> x, y;
    int count = 0;
  };
  struct Sample {
    Vector3f colour;
    float depth;
    std::int32_t part;
    std::uint16_t instance;
    std::uint8_t label;
    bool touched;
  };
  using Samples = std::array<Sample, kPacket>;
  struct Eye;
  struct Hits;

  Eye eye_at(const SE3& T_world_camera) const;
  void sample(const Eye& eye, const Points& points, int group, bool movables, Samples& samples) const;
  void trace(const Eye& eye, const Points& points, bool movables, Hits& hits) const;
  void light(const Eye& eye, bool movables, Hits& hits) const;
  Vector3f shade(const Eye& eye, const Hits& hits, std::size_t i) const;
  void draw_centres(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables, Image& image) const;
  void smooth_edges(const Eye& eye, const std::vector<cv::Point>& pixels, bool movables, Image& image) const;

  Camera camera_;
  CityPlan plan_;
  Mesh scene_;
  Mesh movables_;
  Painter painter_;
  Tracer scene_tracer_;
  Tracer movables_tracer_;
};

}  // namespace roslam::simulation
